"""Tasks in processes of their own: their answers, their end, and what is left of them."""

import logging
import os
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from compare.runtime.processes import ProcessFailed, in_processes
from compare.runtime.provenance import cores
from pinnray.commands.launch import guarded
from solvers.solver import Progress

ROOT = Path(__file__).parents[3]


def half(number: int, progress: Progress) -> float:
    progress(0.5, f"halving {number}")
    return number / 2


def ended(number: int, progress: Progress) -> float:
    """Task 1 is killed, as by a system without memory; task 2 has a fault."""
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return 1 / (number - 2)


def unwritten(folder: Path, progress: Progress) -> None:
    (folder / "absent" / "file").write_text("")


def threads(_: int, progress: Progress) -> str:
    return os.environ["OMP_NUM_THREADS"]


def warning(number: int, progress: Progress) -> None:
    logging.captureWarnings(True)  # as FFCx does when it is imported
    warnings.warn("the disk\nis full", UserWarning, stacklevel=1)


def endless(folder: Path, progress: Progress) -> None:
    """Counts until it is interrupted, and then leaves a word."""
    try:
        while True:
            progress(0.0, str(os.getpid()))
            time.sleep(0.02)
    except KeyboardInterrupt:
        (folder / str(os.getpid())).write_text("saved")
        raise


def endless_with_petsc(folder: Path, progress: Progress) -> None:
    """The same where PETSc, which has a mind of its own about broken pipes, is loaded."""
    from petsc4py import PETSc

    PETSc.Vec().createSeq(1).destroy()
    endless(folder, progress)


def until(condition: Callable[[], bool]) -> None:
    limit = time.monotonic() + 20
    while not condition() and time.monotonic() < limit:
        time.sleep(0.05)


def silent(name: str, fraction: float, note: str) -> None:
    pass


def test_every_task_is_answered_and_reports_under_its_name():
    said = []
    tasks = {f"task {number}": number for number in range(3)}
    answers = dict(in_processes(half, tasks, processes=2, report=lambda *what: said.append(what)))
    assert answers == {"task 0": 0.0, "task 1": 0.5, "task 2": 1.0}
    assert sorted(said) == [(f"task {number}", 0.5, f"halving {number}") for number in range(3)]


def test_a_process_that_ends_without_an_answer_does_not_stop_the_others(capfd):
    answers = dict(in_processes(ended, {"a": 1, "b": 2, "c": 3}, processes=3, report=silent))
    assert answers == {"a": ProcessFailed(-signal.SIGKILL), "b": ProcessFailed(1), "c": 1.0}
    assert "ZeroDivisionError" in capfd.readouterr().err  # whose fault it is can be read


def test_a_process_that_ends_before_it_has_read_a_large_task_is_noticed(monkeypatch):
    """Its parent must not wait for a reader: the task is larger than a pipe holds."""
    program, main = Path(__file__).with_name("ends_at_once.py"), sys.modules["__main__"]
    monkeypatch.setattr(main, "__file__", str(program), raising=False)  # a worker of xdist has none
    monkeypatch.setattr(main, "__spec__", None)
    answers = dict(in_processes(half, {"a": bytes(2**22)}, processes=1, report=silent))
    assert answers == {"a": ProcessFailed(5)}


def test_a_file_that_cannot_be_written_is_told_in_one_line(tmp_path, capfd):
    answers = dict(in_processes(unwritten, {"a": tmp_path}, processes=1, report=silent))
    assert answers["a"].message == f"{tmp_path}/absent/file: No such file or directory"
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize("work", [endless, endless_with_petsc])
def test_an_interruption_lets_every_process_save_its_state(tmp_path, work):
    heard = set()

    def report(name: str, fraction: float, note: str) -> None:
        heard.add(note)
        if len(heard) == 2:
            raise KeyboardInterrupt

    tasks = {"a": tmp_path, "b": tmp_path, "c": tmp_path}
    with (
        pytest.raises(KeyboardInterrupt),
        closing(in_processes(work, tasks, processes=2, report=report)) as answers,
    ):
        next(answers)
    assert {path.name for path in tmp_path.iterdir()} == heard  # and the third never started


def test_processes_end_with_the_program_that_started_them(tmp_path):
    code = (
        "import sys; sys.path[:0] = sys.argv[1:3]\n"
        "from pathlib import Path\n"
        "from test_processes import endless, silent\n"
        "from compare.runtime.processes import in_processes\n"
        "def report(name, fraction, note): print(note, flush=True)\n"
        "if __name__ == '__main__':\n"
        "    list(in_processes(endless, {'a': Path(sys.argv[3])}, processes=1, report=report))\n"
    )
    script = tmp_path / "script.py"
    script.write_text(code)
    program = subprocess.Popen(
        [sys.executable, str(script), str(ROOT), str(Path(__file__).parent), str(tmp_path)],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert program.stdout is not None
    child = program.stdout.readline().strip()
    program.kill()
    program.communicate()
    until((tmp_path / child).exists)
    assert (tmp_path / child).read_text() == "saved"


@pytest.mark.parametrize(("chosen", "expected"), [(None, "1"), ("3", "3")], ids=["share", "chosen"])
def test_processes_share_the_cores(monkeypatch, chosen, expected):
    """As many processes as cores have one thread each, and this process keeps its own."""
    if chosen is None:
        monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    else:
        monkeypatch.setenv("OMP_NUM_THREADS", chosen)
    tasks = {str(number): number for number in range(cores())}
    answers = dict(in_processes(threads, tasks, processes=cores(), report=silent))
    assert set(answers.values()) == {expected}
    assert os.environ.get("OMP_NUM_THREADS") == chosen


def test_a_warning_of_several_processes_is_one_line_once(capfd):
    def command() -> None:
        list(in_processes(warning, {"a": 1, "b": 2, "c": 3}, processes=2, report=lambda *_: None))

    with warnings.catch_warnings():
        warnings.simplefilter("default")  # Python's own, which pytest replaces
        assert guarded(command) == 0
    assert capfd.readouterr().err == "warning: the disk is full\n"

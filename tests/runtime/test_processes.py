"""A pool of processes: answers of tasks, their end, and what is left of them."""

import logging
import os
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import pytest

from pinnray.commands.launch import guarded
from pinnray.runtime.processes.child import ProcessFailed, end_with_parent
from pinnray.runtime.processes.pool import PATIENCE_S, Pool, child_environment, known_to_children
from pinnray.runtime.progress import Progress

ROOT = Path(__file__).parents[2]


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


def die_once(folder: Path, progress: Progress) -> str:
    try:
        (folder / "died").touch(exist_ok=False)
    except FileExistsError:
        return "alive"
    os.kill(os.getpid(), signal.SIGKILL)
    raise AssertionError


@pytest.mark.parametrize(
    ("module", "known"),
    [
        ("fractions", True),  # on the search path
        ("__main__", False),  # the calling script
        ("of_the_working_folder", False),
        ("a_notebook", False),
    ],
)
def test_a_child_knows_classes_of_modules_on_the_path(module, known, tmp_path, monkeypatch):
    (tmp_path / "of_the_working_folder.py").touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend("")
    kind = type("Own", (), {"__module__": module})
    monkeypatch.setitem(sys.modules, module, sys.modules.get(module, SimpleNamespace()))
    monkeypatch.setattr(sys.modules[module], "Own", kind, raising=False)  # so that it can be pickled
    assert known_to_children(kind()) == known


def test_a_child_cannot_be_given_an_object_of_a_function_s_class():
    class Local:
        pass

    assert not known_to_children(Local())


def process_number(_: object, progress: Progress) -> int:
    return os.getpid()


def bound_process(_: object, progress: Progress) -> int:
    end_with_parent()
    return os.getpid()


def time_out(seconds: int, progress: Progress) -> int:
    time.sleep(seconds)
    return seconds


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


def answers_of(work: Callable[..., object], tasks: Mapping[str, object], **options: object) -> dict:
    """All answers of two processes."""
    with Pool(2) as pool:
        return dict(pool.answers(work, tasks, **options))


def test_every_task_is_answered_and_reports_under_its_name():
    said = []
    tasks = {f"task {number}": number for number in range(3)}
    answers = answers_of(half, tasks, report=lambda *what: said.append(what))
    assert answers == {"task 0": 0.0, "task 1": 0.5, "task 2": 1.0}
    assert sorted(said) == [(f"task {number}", 0.5, f"halving {number}") for number in range(3)]


@pytest.mark.slow
def test_a_process_that_ends_without_an_answer_does_not_stop_the_others(capfd):
    answers = answers_of(ended, {"a": 1, "b": 2, "c": 3})
    assert answers == {"a": ProcessFailed(-signal.SIGKILL), "b": ProcessFailed(1), "c": 1.0}
    assert "ZeroDivisionError" in capfd.readouterr().err  # whose fault it is can be read


@pytest.mark.slow
def test_a_task_is_tried_again_where_a_process_may_die(tmp_path):
    """The first process that reads it is killed, as by somebody else."""
    assert answers_of(die_once, {"a": tmp_path}, deaths=2) == {"a": "alive"}
    assert answers_of(ended, {"a": 1}, deaths=2) == {"a": ProcessFailed(-signal.SIGKILL)}


def test_a_process_stays_for_the_next_task():
    with Pool(1) as pool:
        numbers = [dict(pool.answers(process_number, {each: None}))[each] for each in "ab"]
    assert numbers[0] == numbers[1] != os.getpid()


def test_a_process_that_ends_before_it_has_read_a_large_task_is_noticed(monkeypatch):
    """Its parent must not wait for a reader: the task is larger than a pipe holds."""
    monkeypatch.setattr("pinnray.runtime.processes.pool._CHILD", "import os; os._exit(5)")
    assert answers_of(half, {"a": bytes(2**22)}) == {"a": ProcessFailed(5)}


def test_a_task_that_takes_too_long_is_ended():
    before = time.monotonic()
    assert answers_of(time_out, {"a": 60, "b": 0}, timeout_s=6) == {"a": ProcessFailed(None), "b": 0}
    assert time.monotonic() - before < 20


@pytest.mark.slow
def test_a_file_that_cannot_be_written_is_told_in_one_line(tmp_path, capfd):
    answers = answers_of(unwritten, {"a": tmp_path})
    assert answers["a"].message == f"{tmp_path}/absent/file: No such file or directory"
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize("work", [endless, pytest.param(endless_with_petsc, marks=pytest.mark.slow)])
def test_an_interruption_lets_every_process_save_its_state(tmp_path, work):
    heard = set()

    def report(name: str, fraction: float, note: str) -> None:
        heard.add(note)
        if len(heard) == 2:
            raise KeyboardInterrupt

    tasks = {"a": tmp_path, "b": tmp_path, "c": tmp_path}
    with (
        Pool(2) as pool,
        pytest.raises(KeyboardInterrupt),
        closing(pool.answers(work, tasks, report=report)) as answers,
    ):
        next(answers)
    assert {path.name for path in tmp_path.iterdir()} == heard  # and the third never started


def test_processes_end_with_the_program_that_started_them(tmp_path):
    code = (
        "import sys; sys.path[:0] = sys.argv[1:3]\n"
        "from pathlib import Path\n"
        "from test_processes import endless\n"
        "from pinnray.runtime.processes.pool import Pool\n"
        "def report(name, fraction, note): print(note, flush=True)\n"
        "list(Pool(1).answers(endless, {'a': Path(sys.argv[3])}, report=report))\n"  # without a guard
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


@pytest.mark.parametrize(
    ("chosen", "expected"), [(None, "2"), pytest.param("3", "3", marks=pytest.mark.slow, id="chosen")]
)
def test_processes_have_their_share_of_the_cores(monkeypatch, chosen, expected):
    """This process keeps its own threads."""
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    if chosen:
        monkeypatch.setenv("OMP_NUM_THREADS", chosen)
    with Pool(1, threads=2) as pool:
        assert dict(pool.answers(threads, {"a": 1})) == {"a": expected}
    assert os.environ.get("OMP_NUM_THREADS") == chosen


def test_a_process_does_not_inherit_an_mpi_run():
    ranks = {"OMPI_COMM_WORLD_RANK": "1", "PMIX_RANK": "1", "PMI_RANK": "0"}
    kept = child_environment({**ranks, "PATH": "/bin", "PYTHONPATH": "/x"})
    assert set(kept) == {"PATH", "PYTHONPATH"}
    assert kept["PYTHONPATH"].endswith(os.pathsep + "/x")


@pytest.mark.slow
def test_a_warning_of_several_processes_is_one_line_once(capfd):
    with warnings.catch_warnings():
        warnings.simplefilter("default")  # Python's own, which pytest replaces
        assert guarded(lambda: len(answers_of(warning, {"a": 1, "b": 2, "c": 3}))) == 3
    assert capfd.readouterr().err == "warning: the disk is full\n"


@pytest.mark.slow
def test_a_process_beside_this_one_stays_for_the_next_task():
    """The system ends processes with the thread that made them: it is not the one that waits."""
    with Pool(1) as pool:
        found = []
        for _ in range(2):
            with pool.beside(bound_process, None) as answer:
                found.append(answer.result())
            time.sleep(0.1)
    assert found[0] == found[1]


def imported(module: str, progress: Progress) -> bool:
    return module in sys.modules


@pytest.mark.slow
def test_a_process_that_is_started_early_imports_what_it_is_told_as_far_as_there_is():
    with Pool(1, modules=["no_such_module", "tests.geometry.broken_module", "fractions"]) as pool:
        pool.start()
        assert list(pool.answers(imported, {0: "fractions"})) == [(0, True)]


def test_a_process_that_was_never_asked_is_not_waited_for():
    with Pool(1, modules=["tests.geometry.slow_module"]) as pool:
        pool.start()
        started = time.monotonic()
    assert time.monotonic() - started < PATIENCE_S


@pytest.mark.slow
def test_a_task_beside_a_block_that_raises_saves_its_state(tmp_path):
    said: list[str] = []

    def block() -> None:
        with Pool(1) as pool, pool.beside(endless, tmp_path, report=lambda _, note: said.append(note)):
            until(lambda: bool(said))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        block()
    assert [file.read_text() for file in tmp_path.iterdir()] == ["saved"]

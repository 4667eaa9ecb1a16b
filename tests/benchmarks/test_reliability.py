"""Faults at changes of files: where they strike, and what a command makes of some of them."""

import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from benchmarks.reliability.faults import JOBS, faults, filled, plain, trials
from benchmarks.reliability.folders import CUT, numbers
from benchmarks.reliability.supervision import KINDS, Fault, Point, supervised
from pinnray.commands.app import pinnray
from pinnray.runtime.atomic import write_text
from pinnray.runtime.errors import UserError


@contextmanager
def supervisable() -> Iterator[None]:
    """Skip the test where the system does not let a process be supervised."""
    try:
        yield
    except UserError as error:
        if not any(words in str(error) for words in ("refuses seccomp filters", "x86-64 Linux only")):
            raise
        pytest.skip(str(error))


def run(work: Callable[[], int], folder: Path, kind: str | None = None, at: int = 0):
    watched = folder / "watched"
    watched.mkdir(exist_ok=True)
    with supervisable():
        return supervised(work, [watched], folder / "log", fault=kind and Fault(kind, at))


def calls(ending) -> list[tuple[str, str]]:
    return [(point.call, plain(Path(point.path).name)) for point in ending.points]


def test_every_change_of_a_file_is_a_point_also_those_of_children(tmp_path: Path) -> None:
    def work() -> int:
        write_text(tmp_path / "watched" / "a.txt", "a")
        write_text(tmp_path / "elsewhere.txt", "a")
        subprocess.run(["sh", "-c", "echo b > watched/b"], cwd=tmp_path, check=True)
        return 3

    ending = run(work, tmp_path)
    assert (ending.code, ending.orphans) == (3, 0)
    assert calls(ending) == [
        ("openat", ".a.partial.txt"),
        ("write", ".a.partial.txt"),
        ("rename", "a.txt"),
        ("openat", "b"),
        ("write", "b"),
    ]


@pytest.mark.parametrize(
    ("kind", "at", "code", "left"),
    [
        ("kill", 1, -9, {".a.partial.txt": ""}),  # before the write
        ("kill", 2, -9, {".a.partial.txt": "hallo!"}),  # before the rename
        ("EIO", 1, 1, {}),  # the temporary file is removed
        ("ENOSPC", 0, 1, {}),
    ],
)
def test_faults_leave_what_they_say(tmp_path, kind, at, code, left):
    def work() -> int:
        write_text(tmp_path / "watched" / "a.txt", "hallo!")
        return 0

    ending = run(work, tmp_path, kind, at)
    assert (ending.code, len(ending.points) > at) == (code, True)
    found = {plain(path.name): path.read_text() for path in (tmp_path / "watched").iterdir()}
    assert found == left


def test_a_process_that_stays_behind_is_an_orphan(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("benchmarks.reliability.supervision.PATIENCE_S", 0.3)

    def work() -> int:
        subprocess.Popen(["sleep", "30"])
        return 0

    assert run(work, tmp_path).orphans == 1


def test_of_equal_calls_on_a_file_the_first_the_middle_and_the_last_are_chosen() -> None:
    points = [Point("open", "a"), *[Point("write", "a")] * 7, Point("fsync", "b"), Point("rename", "b")]
    struck = {kind: [fault.at for fault in faults(points) if fault.kind == kind] for kind in KINDS}
    assert struck == {"kill": [0, 1, 4, 7, 8, 9], "ENOSPC": [0, 1, 4, 7], "EIO": struck["kill"]}


def test_half_a_file_is_seen_and_times_are_not_compared(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text('{"seconds": 1.0, "force": 2.0}')
    (tmp_path / "b.csv").write_text("force,time\n1,2\n")
    (tmp_path / "c.html").write_text("<html></html>")
    whole = numbers(tmp_path)
    assert CUT not in whole.values()
    (tmp_path / "a.json").write_text('{"seconds": 3.0, "force": 2.0}')
    assert numbers(tmp_path) == whole
    for name, text in (("a.json", '{"seconds": 1.0, "fo'), ("b.csv", "force,time\n1,"), ("c.html", "<html>")):
        (tmp_path / name).write_text(text)
    assert set(numbers(tmp_path).values()) == {CUT}


@pytest.mark.parametrize("line", sorted({line for lines in JOBS.values() for line in lines}))
def test_every_job_is_a_command_of_the_program(line: str) -> None:
    command, bound, _ = pinnray.parse_args(line.split(), exit_on_error=False, print_error=False)
    assert command is not None
    assert bound.arguments


@pytest.mark.release
def test_commands_go_on_after_some_of_the_faults(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What a forked process says is read from its own standard error."""
    with supervisable(), capsys.disabled(), filled(tmp_path) as cache:
        for name in ("compare over an older result", "sweep"):
            tried = trials(JOBS[name], tmp_path / "job", cache, every=71)
            assert len(tried) > 2
            assert not any(tried.values())

"""Faults at changes of files: where they strike, and what a command makes of some of them."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.reliability.document import PAGE, page
from benchmarks.reliability.faults import ROWS, Expected, Row, chosen, differences, known_trials, plain
from benchmarks.reliability.supervision import Fault, Point, supervised
from benchmarks.tables import kept_rows
from pinnray.runtime.atomic import write_text
from pinnray.runtime.errors import UserError

ROOT = Path(__file__).parents[2]


def run(work: Callable[[], int], folder: Path, kind: str | None = None, at: int = 0):
    watched = folder / "watched"
    watched.mkdir(exist_ok=True)
    try:
        return supervised(work, [watched], folder / "log", fault=kind and Fault(kind, at), limit_s=60)
    except UserError as error:
        if not any(words in str(error) for words in ("refuses seccomp filters", "x86-64 Linux only")):
            raise
        pytest.skip(str(error))


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
        ("torn", 1, -9, {".a.partial.txt": "hal"}),  # half of it
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
    assert (ending.code, ending.struck) == (code, True)
    found = {plain(path.name): path.read_text() for path in (tmp_path / "watched").iterdir()}
    assert found == left


@pytest.mark.parametrize(
    ("found", "said"),
    [
        ({"metrics.csv": "1"}, []),
        ({"metrics.csv": "1", "truths/truth.npz": "2"}, []),  # the cache could not keep it
        ({"metrics.csv": "1", "truths/truth.npz": "3"}, ["other numbers: truths/truth.npz"]),
        ({"metrics.csv": "1", "more.csv": "2"}, ["other numbers: more.csv"]),
        ({"metrics.csv": "2"}, ["other numbers: metrics.csv"]),
        ({}, ["other numbers: metrics.csv"]),
    ],
)
def test_numbers_are_those_of_the_undisturbed_run_or_of_its_cache(tmp_path, found, said):
    expected = Expected((), {"metrics.csv": "1"}, {"truth.npz": "2", "metrics.csv": "2"}, tmp_path)
    assert differences(expected, found) == said


def test_a_process_that_stays_behind_is_an_orphan(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("benchmarks.reliability.supervision.PATIENCE_S", 0.3)

    def work() -> int:
        subprocess.Popen(["sleep", "30"])
        return 0

    assert run(work, tmp_path).orphans == 1


def test_of_equal_calls_on_a_file_the_first_the_middle_and_the_last_are_chosen() -> None:
    points = [Point("open", "a"), *[Point("write", "a")] * 7, Point("write", "b"), Point("rename", "b")]
    assert chosen(points) == [0, 1, 4, 7, 8, 9]


def test_kept_trials_are_those_of_the_same_file_by_whatever_number(tmp_path: Path) -> None:
    mesh = f"{tmp_path}/trial/mesh-{'0f' * 32}.npz"
    points = (
        Point("write", f"{tmp_path}/trial/a"),
        Point("rename", f"{tmp_path}/trial/b"),
        Point("fsync", mesh),
    )
    rows = [
        Row("compare", "kill", 9, "rename", "b", -9, "", ""),  # the second point of today
        Row("compare", "kill", 1, "rename", "gone", -9, "", ""),  # a file that is no more
        Row("compare", "EIO", 0, "write", "a", 2, "other numbers", ""),  # not as promised
        Row("compare", "kill", 3, "fsync", f"mesh-{'1e' * 32}.npz", -9, "", ""),  # of another code
    ]
    known, left = known_trials(rows, Expected(points, {}, {}, tmp_path), tmp_path)
    assert known == [rows[0]._replace(at=1), rows[3]._replace(at=2)]
    faults = [Fault("kill", 0), Fault("torn", 0), Fault("ENOSPC", 0), *(Fault("EIO", at) for at in range(3))]
    assert left == faults


def test_the_page_is_that_of_the_kept_trials() -> None:
    assert PAGE.read_text(encoding="utf-8").splitlines()[8:] == page(kept_rows(ROWS, Row)).splitlines()[8:]

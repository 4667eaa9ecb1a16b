"""Trials: a command meets a fault at one of its points, and the same command goes on afterwards."""

import os
import re
import shutil
import sys
import tempfile
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from itertools import groupby
from pathlib import Path
from typing import NamedTuple
from unittest.mock import patch

from benchmarks.reliability.folders import broken, incomplete, leftovers, numbers
from benchmarks.reliability.jobs import CACHE, FEM, JOBS, OUT, Job, prepared, started
from benchmarks.reliability.supervision import GROWING, KINDS, Ending, Fault, Point
from benchmarks.tables import keep_rows, kept_rows

ROWS = Path(__file__).with_name("faults.csv")
REFUSED, NOT_CONVERGED = 2, 3
WHOLE = "the complete result is in"
"""Said by a command that cannot replace its output folder; one that cannot resume has it moved first."""
TRACE = "Traceback (most recent call last)"
TRIAL = "trial"


class Row(NamedTuple):
    """A trial: the fault and its place, the exit code, the promises broken and the files left over."""

    job: str
    kind: str
    at: int
    call: str
    path: str
    code: int
    faults: str
    leftovers: str


class Expected(NamedTuple):
    """A job's run without any fault."""

    points: tuple[Point, ...]  # its changes of files
    numbers: dict[str, str]  # digests of its numbers
    cached: dict[str, str]  # digests of the numbers in its cache, by file name
    folder: Path  # as it was before the run, to be copied


def run_faults(words: Collection[str] = ()) -> list[Row]:
    """Run the trials that are not kept yet, or were not as promised, and keep their rows.

    Only those of the jobs with one of the words in their names; none means all.
    """
    rows = kept_rows(ROWS, Row)
    order = {job.name: number for number, job in enumerate(JOBS)}
    with tempfile.TemporaryDirectory(prefix="reliability-") as name, filled(Path(name)) as cache:
        place = Path(name) / "job"
        for job in JOBS:
            if words and not any(word in job.name for word in words):
                continue
            expected = undisturbed(job, place, cache)
            known, left = known_trials([row for row in rows if row.job == job.name], expected, place)
            rows = [*(row for row in rows if row.job != job.name), *known]
            for fault in left:
                rows.append(trial(job, expected, fault, copied(expected, place)))
                print(*rows[-1], sep="  ", file=sys.stderr, flush=True)
                rows.sort(key=lambda row: (order[row.job], KINDS.index(row.kind), row.at))
                keep_rows(ROWS, Row, rows)
            shutil.rmtree(place)
    return rows


def known_trials(rows: Sequence[Row], expected: Expected, place: Path) -> tuple[list[Row], list[Fault]]:
    """Rows of a job that hold for its points of today, numbered as these are, and the faults without one.

    Two processes change their files in another order each time, so that a row is found by its file. The
    name of one in the cache has a digest that changes with the code.
    """
    stock: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        if not row.faults:
            stock.setdefault((row.kind, row.call, undated(row.path)), []).append(row)
    known, left = [], []
    for fault in faults(expected):
        point = shown(expected.points[fault.at], place / TRIAL)
        if found := stock.get((fault.kind, point.call, undated(point.path))):
            known.append(found.pop(0)._replace(at=fault.at))
        else:
            left.append(fault)
    return known, left


def undisturbed(job: Job, folder: Path, cache: Path) -> Expected:
    """Prepare a job, run it without a fault and keep its points and numbers."""
    prepared(job, folder / "before", cache)
    run = folder / TRIAL  # as later: files name the folder that they come from
    shutil.copytree(folder / "before", run)
    ending = started(job.arguments, run, job.watched)
    if ending.code not in (0, NOT_CONVERGED):
        raise RuntimeError(f"{job.name}: {ending.text}")
    cached = {Path(name).name: digest for name, digest in numbers(run / CACHE).items()}
    return Expected(ending.points, numbers(run / OUT), cached, folder / "before")


def chosen(points: Sequence[Point]) -> list[int]:
    """Numbers of the points that differ: of a series of equal calls on a file the first, middle and last."""
    found: list[int] = []
    for _, group in groupby(range(len(points)), key=lambda at: (points[at].call, plain(points[at].path))):
        series = list(group)
        found += sorted({series[0], series[len(series) // 2], series[-1]})
    return found


def plain(path: str) -> str:
    """A path without the number that makes a temporary file unique."""
    return re.sub(r"\.[0-9a-f]{8}\.partial", ".partial", path)


def undated(path: str) -> str:
    """A path without the digests of files of the cache and the random names of temporary files."""
    return re.sub(r"[0-9a-f]{64}|(?<=[-/])(tmp)?[a-z0-9_]{8}(?=/|$)", "", path)


def shown(point: Point, folder: Path) -> Point:
    """A point with its path as seen from the folder of the run."""
    return Point(point.call, plain(point.path).replace(f"{folder}/", ""))


def faults(expected: Expected) -> list[Fault]:
    """Every fault at every chosen point: writes are torn, and a full disk stops what needs more of it."""
    calls = {"torn": {"write"}, "ENOSPC": GROWING}
    return [
        Fault(kind, at)
        for kind in KINDS
        for at in chosen(expected.points)
        if kind not in calls or expected.points[at].call in calls[kind]
    ]


def copied(expected: Expected, place: Path) -> Path:
    """A folder that is as it was before the run."""
    shutil.rmtree(place / TRIAL, ignore_errors=True)
    return Path(shutil.copytree(expected.folder, place / TRIAL))


def trial(job: Job, expected: Expected, fault: Fault, folder: Path) -> Row:
    """Try a fault in a folder that is as it was before the run."""
    before = numbers(folder / OUT)
    hit = started(job.arguments, folder, job.watched, fault)
    wrong = [] if hit.struck else ["the point was not reached"]
    if hit.orphans:
        wrong.append(f"{hit.orphans} processes were left over")
    wrong += [f"half written: {each}" for place in folder.glob("*out*") for each in broken(place)]
    wrong += [f"poisoned: {each}" for each in broken(folder / CACHE)]
    if fault.kind in ("ENOSPC", "EIO"):
        wrong += _ended_badly(expected, hit, folder)
    if job.whole:
        wrong += _half_replaced(expected, before, folder / OUT)
    if not job.again and WHOLE in hit.text:
        wrong += differences(expected, numbers(folder / f"{OUT}.partial"))
        (folder / f"{OUT}.partial").rename(folder / "moved")
    again = started((*job.arguments, *job.again), folder, job.watched)
    if again.code not in (0, NOT_CONVERGED) or TRACE in again.text:
        wrong.append(f"the next run ends with {again.code}: {again.text.strip()[-300:]}")
    else:
        wrong += differences(expected, numbers(folder / OUT))
    point = shown((hit.points if hit.struck else expected.points)[fault.at], folder)
    left = [each for each in leftovers(folder) if not each.startswith("tmp")]
    texts = (" | ".join(said).replace('"', "'").replace("\n", " ") for said in (wrong, left))
    return Row(job.name, *fault, *point, hit.code, *texts)


def differences(expected: Expected, found: dict[str, str]) -> list[str]:
    """Files whose numbers are not those of the undisturbed run.

    A file that the cache could not keep may lie in the output folder, with the numbers it has in the cache.
    """
    own = {
        name: digest
        for name, digest in found.items()
        if name in expected.numbers or expected.cached.get(Path(name).name) != digest
    }
    names = sorted(
        name for name in own.keys() | expected.numbers if own.get(name) != expected.numbers.get(name)
    )
    return [f"other numbers: {', '.join(names)}"] if names else []


def _ended_badly(expected: Expected, hit: Ending, folder: Path) -> list[str]:
    """Broken promises in the end of a run that met an error."""
    said = hit.text.strip()[-300:]
    if hit.code < 0 or hit.code == 1 or TRACE in hit.text:
        return [f"it ended with {hit.code}: {said}"]
    if hit.code == REFUSED and sum(line.startswith("error:") for line in hit.text.splitlines()) != 1:
        return [f"it did not say why in one line: {said}"]
    return differences(expected, numbers(folder / OUT)) if hit.code == 0 else []


def _half_replaced(expected: Expected, before: dict[str, str], out: Path) -> list[str]:
    """Broken promises of an output folder, which has to be the last result or the new one."""
    if not out.exists():
        return ["the last result is no longer under its name"] if before else []
    whole = numbers(out) in (before, expected.numbers)
    return incomplete(out) + (
        [] if whole else ["the output folder holds neither the last result nor the new"]
    )


@contextmanager
def filled(folder: Path) -> Iterator[Path]:
    """A filled cache in a folder; in the block this process has imported what its forks need."""
    if (ending := started(FEM, folder)).code:
        raise RuntimeError(ending.text)
    from pinnray.cli import main
    from pinnray.comparison.figures import gallery
    from pinnray.runtime.figure import Figure

    blank = gallery.Illustration(Figure(1.0), "Blank", "Blank.", "Blank.")
    drawings = {name: (what, lambda _: blank) for name, (what, _) in gallery.GALLERY.items()}
    with (
        # The same files with blank pictures, in a tenth of the time.
        patch.object(gallery, "GALLERY", drawings),
        patch("pinnray.runtime.figure.DPI", 20),
        # Two processes work on any mesh, not only where that is worth its while.
        patch("pinnray.comparison.pipeline.solving.LARGE", 0),
    ):
        with patch.dict(os.environ, PINNRAY_CACHE=str(folder / CACHE)):
            main([each.replace("FOLDER", str(folder)) for each in FEM])
        shutil.rmtree(folder / "out")
        yield folder / CACHE

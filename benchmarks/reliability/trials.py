"""Trials: a command meets a fault at one of its points, and the same command goes on afterwards."""

import re
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from benchmarks.reliability.folders import broken, incomplete, leftovers, numbers
from benchmarks.reliability.jobs import CACHE, OUT, Job, prepared, started
from benchmarks.reliability.supervision import GROWING, KINDS, Ending, Fault, Point

REFUSED, NOT_CONVERGED = 2, 3
WHOLE = "the complete result is in"
"""What a command says that cannot replace its output folder; one that cannot resume has it moved first."""

TRIAL = "trial"
TRACE = "Traceback (most recent call last)"


@dataclass(frozen=True)
class Trial:
    """A fault and what came of it.

    Attributes:
        job: Name of the job.
        fault: The fault.
        point: Where it struck.
        code: Exit code of the run that met it; negative for a signal.
        faults: What went wrong, one sentence each; empty if all is as promised.
        leftovers: Temporary files that are still there when the second run has ended.
    """

    job: str
    fault: Fault
    point: Point
    code: int
    faults: tuple[str, ...]
    leftovers: tuple[str, ...] = ()


@dataclass(frozen=True)
class Expected:
    """A job's run without any fault.

    Attributes:
        points: Its changes of files.
        numbers: Digests of its numbers.
        cached: Digests of the numbers in its cache, by file name.
        folder: The folder before the run, to be copied.
    """

    points: tuple[Point, ...]
    numbers: dict[str, str]
    cached: dict[str, str]
    folder: Path


def undisturbed(job: Job, folder: Path, cache: Path) -> Expected:
    """Prepare a job, run it without a fault and keep what it gives."""
    prepared(job, folder / "before", cache)
    run = folder / TRIAL  # as later: files name the folder that they come from
    shutil.copytree(folder / "before", run)
    ending = started(job.arguments, run, job.watched)
    if ending.code not in (0, NOT_CONVERGED):
        raise RuntimeError(f"{job.name}: {ending.text}")
    found = numbers(run / OUT)
    cached = {Path(name).name: digest for name, digest in numbers(run / CACHE).items()}
    shutil.rmtree(run)
    return Expected(ending.points, found, cached, folder / "before")


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
        if expected.points[at].call in calls.get(kind, {expected.points[at].call})
    ]


def trials(job: Job, expected: Expected, which: Sequence[Fault], folder: Path) -> Iterator[Trial]:
    """Try faults one after another, each from the state before the run."""
    for fault in which:
        place = folder / TRIAL
        shutil.rmtree(place, ignore_errors=True)
        shutil.copytree(expected.folder, place)
        yield trial(job, expected, fault, place)


def trial(job: Job, expected: Expected, fault: Fault, folder: Path) -> Trial:
    """Try a fault in a folder that is as it was before the run."""
    before = numbers(folder / OUT)
    hit = started(job.arguments, folder, job.watched, fault)
    wrong = []
    if not hit.struck:
        wrong.append("the point was not reached")
    if hit.orphans:
        wrong.append(f"{hit.orphans} processes were left over")
    wrong += [f"half written: {each}" for place in folder.glob("*out*") for each in broken(place)]
    wrong += [f"poisoned: {each}" for each in broken(folder / CACHE)]
    wrong += _after(job, expected, fault, hit, before, folder)
    if not job.again and WHOLE in hit.text:
        wrong += differences(expected, numbers(folder / f"{OUT}.partial"))
        (folder / f"{OUT}.partial").rename(folder / "moved")
    again = started((*job.arguments, *job.again), folder, job.watched)
    if again.code not in (0, NOT_CONVERGED) or TRACE in again.text:
        wrong.append(f"the next run ends with {again.code}: {_last(again.text)}")
    else:
        wrong += differences(expected, numbers(folder / OUT))
    point = hit.points[fault.at] if hit.struck else expected.points[fault.at]
    left = tuple(each for each in leftovers(folder) if not each.startswith("tmp"))
    return Trial(job.name, fault, shown(point, folder), hit.code, tuple(wrong), left)


def differences(expected: Expected, found: dict[str, str]) -> list[str]:
    """Files whose numbers are not those of the undisturbed run.

    A file that the cache could not keep may lie in the output folder, with the numbers it has in the cache.
    """
    return _differences(
        expected.numbers,
        {
            name: digest
            for name, digest in found.items()
            if name in expected.numbers or expected.cached.get(Path(name).name) != digest
        },
    )


def _differences(expected: dict[str, str], found: dict[str, str]) -> list[str]:
    names = sorted(name for name in expected.keys() | found.keys() if expected.get(name) != found.get(name))
    return [f"other numbers: {', '.join(names)}"] if names else []


def _after(
    job: Job, expected: Expected, fault: Fault, hit: Ending, before: dict[str, str], folder: Path
) -> list[str]:
    """What is wrong with the end of a run that met a fault, and with its output folder."""
    wrong = []
    if fault.kind in ("ENOSPC", "EIO"):
        if hit.code < 0 or hit.code == 1 or TRACE in hit.text:
            wrong.append(f"it ended with {hit.code}: {_last(hit.text)}")
        elif hit.code == REFUSED and len(_lines(hit.text, "error:")) != 1:
            wrong.append(f"it did not say why in one line: {hit.text.strip()[-300:]}")
        elif hit.code == 0:
            wrong += differences(expected, numbers(folder / OUT))
    if job.whole and (folder / OUT).exists():
        wrong += incomplete(folder / OUT)
        if (now := numbers(folder / OUT)) not in (before, expected.numbers):
            wrong.append("the output folder holds neither the last result nor the new one")
            wrong += _differences(before or expected.numbers, now)
    elif job.whole and before:
        wrong.append("the last result is no longer under its name")
    return wrong


def _lines(text: str, start: str) -> list[str]:
    return [line for line in text.splitlines() if line.startswith(start)]


def _last(text: str) -> str:
    return (text.strip().splitlines() or ["nothing was said"])[-1][:300]

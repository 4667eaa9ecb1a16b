"""The trials of all jobs: run, kept as a table, and counted."""

import csv
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple
from unittest.mock import patch

from benchmarks.reliability.jobs import CACHE, FEM, JOBS, started
from benchmarks.reliability.supervision import KINDS, Fault, Kind
from benchmarks.reliability.trials import TRIAL, Expected, Trial, faults, shown, trials, undisturbed
from geometry.atomic import write_text

ROWS = Path(__file__).with_name("faults.csv")
SEPARATOR = " | "


class Row(NamedTuple):
    """A trial as it is kept; what went wrong and what was left over with `SEPARATOR` between."""

    job: str
    kind: Kind
    at: int
    call: str
    path: str
    code: int
    faults: str
    leftovers: str


def run_faults(words: Collection[str] = ()) -> list[Row]:
    """Run the trials that are not kept yet, or were not as promised, and keep their rows.

    Args:
        words: Only those of the jobs with one of these in their names; none means all.
    """
    asked = [job for job in JOBS if not words or any(word in job.name for word in words)]
    kept = kept_rows()
    with tempfile.TemporaryDirectory(prefix="reliability-") as name, filled(Path(name)) as cache:
        folder = Path(name)
        for job in asked:
            place = folder / "job"
            expected = undisturbed(job, place, cache)
            others = [row for row in kept if row.job != job.name]
            known, left = known_trials([row for row in kept if row.job == job.name], expected, place)
            kept = [*others, *known]
            for done in trials(job, expected, left, place):
                kept.append(_row(done))
                print(*kept[-1], sep="  ", file=sys.stderr, flush=True)
                write_rows(kept)
            shutil.rmtree(place)
    return kept


def known_trials(rows: Sequence[Row], expected: Expected, place: Path) -> tuple[list[Row], list[Fault]]:
    """Rows of a job that hold for its points of today, numbered as these are, and the faults without one.

    Two processes change their files in another order each time, so that a row is found by its file.
    """
    stock: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        if not row.faults:
            stock.setdefault((row.kind, row.call, row.path), []).append(row)
    known, left = [], []
    for fault in faults(expected):
        point = shown(expected.points[fault.at], place / TRIAL)
        if found := stock.get((fault.kind, point.call, point.path)):
            known.append(found.pop(0)._replace(at=fault.at))
        else:
            left.append(fault)
    return known, left


def kept_rows() -> list[Row]:
    """The trials as they were kept."""
    if not ROWS.exists():
        return []
    with ROWS.open(encoding="utf-8", newline="") as file:
        return [
            Row(job, kind, int(at), call, path, int(code), *rest)
            for job, kind, at, call, path, code, *rest in list(csv.reader(file))[1:]
        ]


def write_rows(rows: Sequence[Row]) -> None:
    """Keep the trials, by job."""
    order = {job.name: number for number, job in enumerate(JOBS)}
    lines = [Row._fields, *sorted(rows, key=lambda row: (order[row.job], KINDS.index(row.kind), row.at))]
    text = [",".join(f'"{cell}"' if "," in str(cell) else str(cell) for cell in line) for line in lines]
    write_text(ROWS, "\n".join(text) + "\n")


def _row(trial: Trial) -> Row:
    said = [
        SEPARATOR.join(texts).replace('"', "'").replace("\n", " ")
        for texts in (trial.faults, trial.leftovers)
    ]
    return Row(
        *(trial.job, trial.fault.kind, trial.fault.at, trial.point.call, trial.point.path, trial.code),
        *said,
    )


@contextmanager
def filled(folder: Path) -> Iterator[Path]:
    """A filled cache in a folder; in the block this process has imported what its forks need."""
    if (ending := started(FEM, folder)).code:
        raise RuntimeError(ending.text)
    from compare.cli import main

    # Two processes work on any mesh, not only where that is worth its while.
    with _cheap_pictures(), patch("compare.pipeline.solving.LARGE", 0):
        with patch.dict(os.environ, PINNRAY_CACHE=str(folder / CACHE)):
            main([each.replace("FOLDER", str(folder)) for each in FEM])
        shutil.rmtree(folder / "out")
        yield folder / CACHE


@contextmanager
def _cheap_pictures() -> Iterator[None]:
    """Let the pictures of a comparison be blank: the same files, a tenth of the time."""
    from compare.figures import gallery
    from geometry.figure import Figure

    def blank(_: object) -> gallery.Drawing:
        return gallery.Drawing(Figure(1.0), "Blank", "Blank.", "Blank.")

    drawings: dict[str, tuple[str, Callable[[object], gallery.Drawing]]]
    drawings = {name: (what, blank) for name, (what, _) in gallery.DRAWINGS.items()}
    with patch.object(gallery, "DRAWINGS", drawings), patch("geometry.figure.DPI", 20):
        yield

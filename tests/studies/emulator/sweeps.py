"""Sweeps for the tests: a kept table of solved fingers, and quantities in closed form."""

import csv
from collections.abc import Callable, Mapping
from pathlib import Path

from pinnray.runtime.atomic import write_json
from pinnray.studies.sweep.job import StudyJob
from pinnray.studies.sweep.measurement import Measurement
from pinnray.studies.sweep.sampling import samples
from pinnray.studies.sweep.store import JOURNAL, opened
from pinnray.studies.sweep.study import Study, Value
from pinnray.studies.sweep.sweep import STUDY_FILE

DATA = Path(__file__).parents[2] / "data" / "sweep"
"""`ref.csv`: force, tip displacement, wrap angle and stress of the first fingers of the study `ref.toml`."""


def solved_sweep(folder: Path, *, count: int = 300, left_out: tuple[str, ...] = ()) -> Path:
    """A folder with the first samples of the kept table."""
    study = Study.load(DATA / "ref.toml")
    with (DATA / "ref.csv").open(encoding="utf-8") as table:
        rows = [
            {name: float(cell) for name, cell in row.items() if name not in left_out}
            for row in csv.DictReader(table)
        ]
    done = [Measurement(int(row.pop("sample")), "done", "", 0.1, row) for row in rows[:count]]
    return kept(folder, study, done)


def synthetic_sweep(
    folder: Path, study: Study, quantities: Callable[[Mapping[str, Value]], dict[str, float]]
) -> Path:
    """A folder with every sample of a study and quantities in closed form."""
    done = [
        Measurement(number, "done", "", 0.1, quantities(sample))
        for number, sample in enumerate(samples(study))
    ]
    return kept(folder, study, done)


def kept(folder: Path, study: Study, done: list[Measurement]) -> Path:
    """A sweep's folder with a study and its results."""
    folder.mkdir(parents=True, exist_ok=True)
    first = StudyJob(study, folder, folder / "out").task(0, samples(study)[0]).definition
    write_json(
        folder / STUDY_FILE,
        {
            "study": study.model_dump(mode="json", by_alias=True, exclude_none=True),
            "finger": {name: value for name, value in first.items() if name not in study.varied},
        },
    )
    with opened(folder / JOURNAL) as journal:
        for each in done:
            journal.add(each)
    return folder

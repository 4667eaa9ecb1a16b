"""The runs of a grid search, ranked, as a CSV file and as a table for the terminal."""

from collections.abc import Sequence
from dataclasses import asdict, fields
from math import inf
from pathlib import Path

from rich.table import Table

from compare.runtime.tables import NONE, Cell, terminal_table, write_csv
from studies.gridsearch.training_run import TrainingMetrics, TrainingRun

UNITS = {
    "base_violation": "mm",
    "load_violation": "mm",
    "energy": "N_mm_per_mm",
    "loss": "MPa",
    "seconds": "s",
}
"""Units of the columns."""


def ranked(runs: Sequence[TrainingRun]) -> list[TrainingRun]:
    """The runs by their distance from `fem`, failed runs last; losses do not compare between weights."""
    return sorted(runs, key=lambda run: run.measured.rel_l2_displacement if run.measured else inf)


def best_of(runs: Sequence[TrainingRun]) -> TrainingRun | None:
    """The run nearest to `fem`; None if none was trained."""
    return next((run for run in ranked(runs) if run.measured), None)


def run_note(run: TrainingRun) -> str:
    """A run in a few words."""
    if run.measured is None:
        return f"{run.status}: {run.message}"
    return (
        f"relative L2 to fem {run.measured.rel_l2_displacement:.1%}, "
        f"boundary violation {run.measured.boundary_violation:.1%}"
    )


def write_runs(path: Path, runs: Sequence[TrainingRun]) -> None:
    """Write a row for each run, with units in the header; unknown values are empty."""
    write_csv(path, [{"rank": rank, **_row(run)} for rank, run in enumerate(ranked(runs), start=1)])


def _row(run: TrainingRun) -> dict[str, Cell]:
    values = asdict(run.measured) if run.measured else {}
    row: dict[str, Cell] = {
        "learning_rate": run.point.learning_rate,
        "bc_weight_MPa_per_mm2": run.point.bc_weight,
        "status": run.status,
    }
    for name in (entry.name for entry in fields(TrainingMetrics)):
        row["_".join(filter(None, [name, UNITS.get(name)]))] = values.get(name, "")
    return row | {"message": run.message}


def runs_table(runs: Sequence[TrainingRun]) -> Table:
    """The runs for the terminal."""
    rows = []
    for run in ranked(runs):
        numbers = [run.status, *[NONE] * 4]
        if measured := run.measured:
            numbers = [
                f"{100 * measured.rel_l2_displacement:.3g}",
                f"{1 + measured.rel_energy:.3g}",
                f"{100 * measured.boundary_violation:.3g}",
                f"{measured.loss:.3g}",
                f"{measured.seconds:.0f}",
            ]
        rows.append([f"{run.point.learning_rate:g}", f"{run.point.bc_weight:g}", *numbers])
    return terminal_table(
        "Runs by their distance from fem",
        [
            "learning\nrate",
            "BC weight\nMPa/mm²",
            "L²\n%",
            "energy\nof fem's",
            "violation\n%",
            "loss\nMPa",
            "time\ns",
        ],
        rows,
        caption="L²: relative difference of the displacement field from fem on the same mesh. Violation: of "
        "base or load, over the stroke. Losses do not compare between weights; the order of short trainings "
        "need not be that of long ones.",
    )

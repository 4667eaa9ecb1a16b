"""Table I of the paper: mean absolute errors at markers that a solver was given, and at others.

The paper gives all nine markers to the solver that assimilates them, and judges it by the same nine: that is
a training error. What a solver says of a marker that it was not given is another column here.
"""

from pathlib import Path
from typing import NamedTuple

from compare.evaluation.comparison import Comparison
from compare.evaluation.labels import solver_label
from compare.evaluation.metrics import MarkerErrors, held_out_errors, marker_errors
from compare.runtime.csv_files import Cell, write_csv

MEANS = ("u", "v", "sum", "rss")


class Means(NamedTuple):
    """Mean absolute errors, mm.

    Attributes:
        u: Along the finger.
        v: Across it.
        sum: Mean of |du| + |dv|, as the paper's text has it; None where it is not printed.
        rss: sqrt(u^2 + v^2), which is what the paper's `disp` holds.
    """

    u: float
    v: float
    sum: float | None
    rss: float

    @classmethod
    def of(cls, errors: MarkerErrors | None) -> "Means | None":
        """The means of errors, if there are any."""
        return errors and cls(errors.mae_u, errors.mae_v, errors.mae_sum, errors.mae_rss)


class Row(NamedTuple):
    """One solver's errors.

    Attributes:
        solver: What it is called.
        source: Where the displacements of the markers come from.
        given: Errors at markers that it was given; None if it was given none.
        held_out: Errors at markers that it was not given: all, or each left out in its turn; None if unknown.
    """

    solver: str
    source: str
    given: Means | None
    held_out: Means | None


PAPER = "paper"
PRINTED = (
    Row("FEM", PAPER, None, Means(1.41, 0.39, None, 1.463)),
    Row("PINN-Ray std", PAPER, None, Means(1.37, 0.48, None, 1.452)),
    Row("PINN-Ray asm", PAPER, Means(0.03, 0.00, None, 0.03), None),
)
"""Table I as it is printed: nine markers of the paper's own experiment, whose data is not published.

Source: X. Wang et al., PINN-Ray, arXiv:2407.08222, Table I.
"""


def table_one(comparison: Comparison) -> list[Row]:
    """A row a solver of this run."""
    observations = comparison.observations
    return [
        Row(
            solver_label(evaluation),
            observations.label,
            Means.of(marker_errors(evaluation, observations)) if evaluation.in_sample else None,
            Means.of(held_out_errors(evaluation, observations)),
        )
        for evaluation in comparison.evaluations
    ]


def millimetres(error: float, printed: bool = False) -> str:
    """A mean error, mm, to 0.001; of those that the paper prints, without a last zero, as there."""
    text = f"{error:.3f}"
    return text.removesuffix("0") if printed else text


def write_table_one(path: Path, comparison: Comparison) -> None:
    """Write a row a solver, then those that the paper prints; what does not exist is empty."""
    write_csv(path, [_cells(row) for row in [*table_one(comparison), *PRINTED]])


def _cells(row: Row) -> dict[str, Cell]:
    cells: dict[str, Cell] = {"solver": row.solver, "observations": row.source}
    for column, means in (("in_sample", row.given), ("held_out", row.held_out)):
        for name in MEANS:
            value = None if means is None else getattr(means, name)
            cells[f"{column}_mae_{name}_mm"] = "" if value is None else value
    return cells

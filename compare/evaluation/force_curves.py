"""Forces of the indenter along and across its stroke, of every solver that follows the load."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.tables import Cell, write_csv
from pinnray.solvers.problem import Load
from pinnray.solvers.solution import stroke_axes

REACTIONS = ("reaction_x", "reaction_y")
"""Columns of a record along the load, N/mm; its first column is `load_fraction`."""


@dataclass(frozen=True, eq=False)
class ForceCurve:
    """Equilibria of one solver along the load."""

    evaluation: Evaluation  #: The solver's result at the end of the curve.
    fraction: FloatArray  #: Of the load, shape (k,).
    stroke: FloatArray  #: Distance that the indenter has moved, shape (k,), mm.
    force: FloatArray  #: Force of the indenter along its stroke, shape (k,), N/mm, which does the work.
    tangential_force: FloatArray  #: The same across it, see `stroke_axes`.

    @classmethod
    def of(cls, evaluation: Evaluation, load: Load) -> "ForceCurve":
        """The recorded path; else a straight line for the linear law, and the end alone for any other."""
        if follows_load(evaluation):
            fraction = evaluation.history["load_fraction"]
            reaction = np.stack([evaluation.history[name] for name in REACTIONS], axis=1)
        else:
            fraction = np.array([0.0, 1.0] if evaluation.law == "linear" else [1.0])
            reaction = np.outer(fraction, evaluation.reaction) + 0.0  # no -0
        length = float(np.linalg.norm(load.values))
        return cls(evaluation, fraction, fraction * length, *(stroke_axes(load) @ reaction.T))


def follows_load(evaluation: Evaluation) -> bool:
    """True if the solver recorded forces along the load."""
    return {"load_fraction", *REACTIONS} <= evaluation.history.keys()


def force_curves(evaluations: Sequence[Evaluation], load: Load) -> list[ForceCurve]:
    """A curve for each solver; none if no solver follows the load, as all would be straight.

    A solver that was given markers has none: they hold at the end of the load, and pull as well.
    """
    if not any(map(follows_load, evaluations)):
        return []
    return [ForceCurve.of(evaluation, load) for evaluation in evaluations if not evaluation.in_sample]


def write_force_displacement(path: Path, curves: Sequence[ForceCurve], *, depth: float) -> None:
    """Write a row an equilibrium: stroke and forces along and across it, in N for a depth, mm."""
    names = ("load_fraction_1", "stroke_mm", "force_N", "tangential_force_N")
    rows: list[dict[str, Cell]] = []
    for curve in curves:
        own, forces = curve.evaluation, (curve.force * depth, curve.tangential_force * depth)
        known: dict[str, Cell] = {"solver": own.solver, "law": own.law, "converged": int(own.converged)}
        numbers = np.column_stack([curve.fraction, curve.stroke, *forces]).tolist()
        rows += [{**known, **dict(zip(names, row, strict=True))} for row in numbers]
    write_csv(path, rows)

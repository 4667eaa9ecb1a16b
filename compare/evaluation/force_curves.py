"""Forces of the indenter along its travel, of every solver that follows the load."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.tables import Cell, write_csv
from pinnray.solvers.problem import Load

REACTIONS = ("reaction_x", "reaction_y")
"""Columns of a record along the load, N/mm; its first column is `load_fraction`."""


@dataclass(frozen=True, eq=False)
class ForceCurve:
    """Equilibria of one solver along the load."""

    evaluation: Evaluation  #: The solver's result at the end of the curve.
    fraction: FloatArray  #: Of the load, shape (k,).
    travel: FloatArray  #: Distance that the indenter has moved, shape (k,), mm.
    reaction: FloatArray  #: Force of the indenter on the finger, shape (k, 2), N/mm.
    force: FloatArray  #: Its component along the travel, shape (k,), N/mm, which does the work.

    @classmethod
    def of(cls, evaluation: Evaluation, load: Load) -> "ForceCurve":
        """The recorded path; else a straight line for the linear law, and the end alone for any other."""
        if follows_load(evaluation):
            fraction = evaluation.history["load_fraction"]
            reaction = np.stack([evaluation.history[name] for name in REACTIONS], axis=1)
        else:
            fraction = np.array([0.0, 1.0] if evaluation.law == "linear" else [1.0])
            reaction = np.outer(fraction, evaluation.reaction) + 0.0  # no -0
        displacement = np.array([value or 0.0 for value in load.displacement])
        length = float(np.linalg.norm(displacement))
        return cls(evaluation, fraction, fraction * length, reaction, reaction @ displacement / length)


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


def write_force_displacement(path: Path, curves: Sequence[ForceCurve], load: Load, *, depth: float) -> None:
    """Write a row an equilibrium: prescribed displacement and force, per mm of depth and for `depth`, mm."""
    rows: list[dict[str, Cell]] = []
    for curve in curves:
        for fraction, travel, reaction, force in zip(
            curve.fraction, curve.travel, curve.reaction, curve.force, strict=True
        ):
            moved = ["" if value is None else float(fraction * value + 0.0) for value in load.displacement]
            row: dict[str, Cell] = {"solver": curve.evaluation.solver, "law": curve.evaluation.law}
            row |= {"converged": int(curve.evaluation.converged), "load_fraction_1": float(fraction)}
            row |= {"indenter_u_mm": moved[0], "indenter_v_mm": moved[1], "travel_mm": float(travel)}
            row |= {"reaction_u_N_per_mm": float(reaction[0]), "reaction_v_N_per_mm": float(reaction[1])}
            row |= {"force_along_travel_N_per_mm": float(force)}
            rows.append(row | {"force_along_travel_of_the_depth_N": float(force * depth)})
    write_csv(path, rows)

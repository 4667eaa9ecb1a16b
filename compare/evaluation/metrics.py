"""A solver's errors at the markers, its distances from reference and truth, its force over displacement."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pinnray.comparison.evaluation.evaluation import (
    Evaluation,
    FieldDifference,
    ReferenceDifferences,
    field_difference,
)
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.geometry.registration import nearest_similarity
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.tables import Cell, write_csv
from pinnray.solvers.finger_figures import figures_of
from pinnray.solvers.problem import Load
from pinnray.solvers.shared_work import shared
from pinnray.solvers.solution import Solution

COMPONENTS: dict[str, tuple[int, int]] = {"xx": (0, 0), "yy": (1, 1), "xy": (0, 1)}


class MarkerErrors(NamedTuple):
    """Errors at the visible markers; rows of markers that were not seen are NaN."""

    ae_u: FloatArray  #: Absolute error of u at each marker, shape (m,), mm.
    ae_v: FloatArray  #: Absolute error of v at each marker, shape (m,), mm.
    mae_u: float  #: Mean of `ae_u` over the visible markers, mm.
    mae_v: float  #: Mean of `ae_v` over the visible markers, mm.
    mae_sum: float  #: Mean of `|du| + |dv|`: the absolute error that the paper's text defines, mm.
    mae_rss: float  #: sqrt(mae_u^2 + mae_v^2), as in row `disp` of the paper's Table I, mm.


MEANS = MarkerErrors._fields[2:]
"""Names of the mean absolute errors."""


def marker_errors(evaluation: Evaluation, observations: Observations) -> MarkerErrors:
    """Absolute and mean absolute errors at the markers, in-sample for a solver that assimilated them."""
    return _errors(evaluation.shown_displacement, observations)


def held_out_errors(evaluation: Evaluation, observations: Observations) -> MarkerErrors | None:
    """Errors at markers that the solver was not given: at all of them, or at each left out in its turn.

    None where no displacement is known, and for a solver that was given all and predicts none without.
    """
    if not observations.known:
        return None
    if not evaluation.in_sample:
        return marker_errors(evaluation, observations)
    return None if evaluation.left_out is None else _errors(evaluation.left_out, observations)


RIGID = "rigid motion off"
"""What is added to the name of a solver whose markers are moved rigidly to the pressed picture."""


def without_rigid_motion(evaluation: Evaluation, observations: Observations) -> Evaluation | None:
    """The evaluation with its markers turned and shifted until they are nearest to the pressed picture's.

    None for a solver that was given the markers, and where the pictures' frames are known: nobody may then
    move them. By least squares over the markers seen.
    """
    known = observations.pressed.fixed and observations.drawn.fixed
    if known or evaluation.in_sample or observations.visible.sum() < 2:
        return None
    seen, points = observations.visible, observations.points
    there, pressed = points + evaluation.shown_displacement, points + observations.displacements
    moved = nearest_similarity(there[seen], pressed[seen], rigid=True).moved(there)
    return replace(evaluation, solver=f"{evaluation.solver}, {RIGID}", shown=moved - points)


def at_markers(evaluations: Sequence[Evaluation], observations: Observations) -> list[Evaluation]:
    """The evaluations for errors at the markers, each followed by that without its rigid motion, if any."""
    pairs = ((each, without_rigid_motion(each, observations)) for each in evaluations)
    return [each for pair in pairs for each in pair if each is not None]


def _errors(displacement: FloatArray, observations: Observations) -> MarkerErrors:
    error = np.abs(displacement - observations.displacements)
    error[~observations.visible] = np.nan
    mae_u, mae_v = error[observations.visible].mean(axis=0).tolist() if observations.known else 2 * [np.nan]
    mae_rss = float(np.hypot(mae_u, mae_v))
    return MarkerErrors(error[:, 0], error[:, 1], mae_u, mae_v, mae_u + mae_v, mae_rss)


def reference_differences(evaluation: Evaluation, reference: Evaluation) -> ReferenceDifferences:
    """Differences of displacement, strain and stress from the reference; shared work."""
    return shared(("differences", evaluation, reference), lambda: _differences(evaluation, reference))


def _differences(evaluation: Evaluation, reference: Evaluation) -> ReferenceDifferences:
    def differ(name: str, index: tuple[int, ...] = ()) -> FieldDifference:
        values, other = (getattr(each, name)[:, *index] for each in (evaluation, reference))
        return field_difference(values, other, reference.weights)

    markers = np.abs(evaluation.marker_displacement - reference.marker_displacement).sum(axis=1)
    return ReferenceDifferences(
        displacement=differ("displacement"),
        von_mises=differ("von_mises"),
        stress={name: differ("stress", index) for name, index in COMPONENTS.items()},
        strain={name: differ("strain", index) for name, index in COMPONENTS.items()},
        mae_markers=float(markers.mean()),
        energy=(evaluation.energy - reference.energy) / reference.energy if reference.energy else np.nan,
    )


class TruthDifferences(NamedTuple):
    """Differences of a solver from the fields of the virtual experiment, on the shared mesh."""

    displacement: FieldDifference  #: Of the displacement vector, mm.
    strain: FieldDifference  #: Of the strain tensor; each law has its own strain.
    von_mises: FieldDifference  #: MPa.


def truth_differences(evaluation: Evaluation, truth: Evaluation) -> TruthDifferences:
    """Differences from the simulated truth; shared work."""

    def differ(name: str) -> FieldDifference:
        values, true = (
            np.reshape(getattr(each, name), (len(truth.weights), -1)) for each in (evaluation, truth)
        )
        return field_difference(values, true, truth.weights)

    return shared(
        ("truth", evaluation, truth), lambda: TruthDifferences(*map(differ, TruthDifferences._fields))
    )


def force_error(evaluation: Evaluation, truth: Evaluation) -> float:
    """Relative error of the size of the indenter's force; positive where it is too large."""
    size, true = (float(np.linalg.norm(each.reaction)) for each in (evaluation, truth))
    return size / true - 1


def pick_reference(evaluations: Sequence[Evaluation], wanted: str | None = None) -> Evaluation:
    """The evaluation called `wanted`, else `fem`, else the first."""
    named = {evaluation.solver: evaluation for evaluation in evaluations}
    return named.get(wanted or "fem", evaluations[0])


def evaluated(solution: Solution, mesh: TriangleMesh, markers: ArrayLike | None = None) -> Evaluation:
    """Evaluate a solution, with its figures, and its uncertainty if its solver estimates its error.

    The uncertainty is the difference of the estimate's improved field from the solution. Under prescribed
    displacements, the energy of the error is the error of the energy.
    """
    own, error = Evaluation.of(solution, mesh, markers), solution.error
    if solution.problem.finger is not None and own.finite:
        own = replace(own, figures=figures_of(solution))
    if error is None:
        return own
    energy = solution.energy * (1 - error.energy_norm**2)
    better = Evaluation.of(replace(solution, field=error.field, energy=energy, states=()), mesh, markers)
    at_markers = np.abs(better.marker_displacement - own.marker_displacement)
    return replace(own, uncertainty=_differences(better, own), marker_uncertainty=at_markers)


def indistinct(differences: ReferenceDifferences, uncertainty: ReferenceDifferences | None) -> list[str]:
    """Quantities in which a solver differs from the reference by less than the reference's error."""
    if uncertainty is None:
        return []
    pairs = {
        "displacement": (differences.displacement.rel_l2, uncertainty.displacement.rel_l2),
        "von Mises stress": (differences.von_mises.rel_l2, uncertainty.von_mises.rel_l2),
        "energy": (differences.energy, uncertainty.energy),
        "displacement of the markers": (differences.mae_markers, uncertainty.mae_markers),
    }
    return [name for name, (difference, own) in pairs.items() if abs(difference) < abs(own)]


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

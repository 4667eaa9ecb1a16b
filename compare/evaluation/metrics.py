"""Computes the scores of a run, once, after its solvers."""

from math import nan
from typing import Any

import numpy as np

from pinnray.comparison.evaluation.differences import FieldDifference
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.evaluation.scores import (
    MEANS,
    FigureScores,
    MarkerErrors,
    Means,
    SolverScores,
    TruthDifferences,
    UncertaintyScores,
)
from pinnray.geometry.observations import Observations
from pinnray.geometry.picture_frame import nearest_similarity
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.problem import Load
from pinnray.solvers.solution import indenter_forces


def solver_scores(
    evaluation: Evaluation,
    observations: Observations,
    reference: Evaluation,
    truth: Evaluation | None,
    load: Load,
) -> SolverScores:
    """Compute every number of a solver."""
    plain = ("family", "twin", "law", "message", "energy", "reaction", "stats", "certificate")
    markers = marker_errors(evaluation.shown_displacement, observations)
    numbers: dict[str, Any] = {name: getattr(evaluation, name) for name in plain} | {
        "status": "converged" if evaluation.converged else "not converged",
        "seconds": evaluation.stats.get("seconds"),
        "identified": evaluation.identified,
        "figures": figure_scores(evaluation),
        "markers": dict(markers) | {"in_sample": evaluation.in_sample},
        "held_out": _held_out(evaluation, observations),
        "rigid_motion_off": _without_rigid_motion(evaluation, observations),
        "uncertainty": _uncertainty(evaluation),
        "to_reference": dict(evaluation.differences_from(reference))
        | {"reference_uncertainty": reference.uncertainty},
        "to_truth": None if truth is None else truth_differences(evaluation, truth),
        "force_to_truth_rel": None if truth is None else force_error(evaluation, truth, load),
    }
    return SolverScores.model_validate(numbers)


def marker_errors(displacement: FloatArray, observations: Observations) -> MarkerErrors:
    """Errors of displacements of the markers, shape (m, 2), mm."""
    error = np.abs(displacement - observations.displacements)
    error[~observations.visible] = nan
    mae_u, mae_v = error[observations.visible].mean(axis=0).tolist() if observations.known else (nan, nan)
    means = {"mae_u": mae_u, "mae_v": mae_v, "mae_sum": mae_u + mae_v, "mae_rss": np.hypot(mae_u, mae_v)}
    return MarkerErrors(ae_u=error[:, 0].tolist(), ae_v=error[:, 1].tolist(), **means)


def _held_out(evaluation: Evaluation, observations: Observations) -> MarkerErrors | None:
    predicted = evaluation.left_out if evaluation.in_sample else evaluation.shown_displacement
    return None if predicted is None or not observations.known else marker_errors(predicted, observations)


def _without_rigid_motion(evaluation: Evaluation, observations: Observations) -> Means | None:
    """Means of the errors of markers that are turned and shifted to be nearest to the pressed picture's.

    None for a solver that was given the markers, and where the pictures' frames are known: nobody may then
    move them. By least squares over the markers seen.
    """
    known = observations.pressed.fixed and observations.drawn.fixed
    if known or evaluation.in_sample or observations.visible.sum() < 2:
        return None
    seen, points = observations.visible, observations.points
    there, pressed = points + evaluation.shown_displacement, points + observations.displacements
    moved = nearest_similarity(there[seen], pressed[seen], rigid=True).moved(there)
    errors = marker_errors(moved - points, observations)
    return Means.model_validate(errors.model_dump(include=set(MEANS)))


def truth_differences(evaluation: Evaluation, truth: Evaluation) -> TruthDifferences:
    """Differences from the simulated truth."""

    def differ(name: str) -> FieldDifference:
        fields = (getattr(each, name) for each in (evaluation, truth))
        values, true = (field.reshape(len(truth.weights), -1) for field in fields)
        return FieldDifference.of(values, true, truth.weights)

    return TruthDifferences(**{name: differ(name) for name in TruthDifferences.model_fields})


def force_error(evaluation: Evaluation, truth: Evaluation, load: Load) -> float:
    """Relative error of the indenter's force along its stroke; positive where it is too large."""
    force, true = (
        float(indenter_forces(load, each.reaction, each.identified)[0]) for each in (evaluation, truth)
    )
    return force / true - 1


def figure_scores(evaluation: Evaluation | None) -> FigureScores | None:
    """What the finger does, if it is known."""
    if evaluation is None or (figures := evaluation.figures) is None:
        return None
    return FigureScores(values=figures.columns(), places=figures.places)


def _uncertainty(evaluation: Evaluation) -> UncertaintyScores | None:
    own, markers = evaluation.uncertainty, evaluation.marker_uncertainty
    if own is None or markers is None:
        return None
    shared = own.model_dump(include={"rel_l2_displacement", "rel_l2_von_mises", "mae_markers"})
    energy, (u, v) = float(np.sqrt(abs(own.rel_energy))), markers.T.tolist()
    return UncertaintyScores(energy_norm=energy, markers_u=u, markers_v=v, **shared)


def truth_scores(truth: Evaluation | None, load: Load) -> FigureScores | None:
    """What the simulated finger does, if there is one, with its force along the stroke of a load.

    Where that is inclined, the truth's own stroke, along y, is another one: forces on its way are not known.
    """
    found = figure_scores(truth)
    if truth is None or found is None or not load.displacement[0]:
        return found
    own = float(np.linalg.norm(truth.reaction))
    depth = float(np.hypot(found.values["force_N"], found.values["tangential_force_N"])) / own
    force, across = depth * indenter_forces(load, truth.reaction, None)
    unknown = dict.fromkeys(("force_25_N", "force_50_N", "force_75_N", "lift_kg"), nan)
    values = {**found.values, **unknown, "force_N": force, "tangential_force_N": across}
    return FigureScores(values=values, places=found.places)

"""`metrics.json`: the numbers of a comparison, for scripts to rely on. Units: mm, MPa, N/mm, s."""

import math
from collections.abc import Mapping
from typing import Any

from compare.evaluation.comparison import Comparison
from compare.evaluation.evaluation import Evaluation, FieldDifference, ReferenceDifferences
from compare.evaluation.metrics import (
    MEANS,
    MarkerErrors,
    force_error,
    held_out_errors,
    marker_errors,
    reference_differences,
    truth_differences,
)

SCHEMA = 1
"""Keys may be added to a schema; a key that is renamed or removed makes a new one."""


def metrics(comparison: Comparison) -> dict[str, Any]:
    """The content of `metrics.json`.

    `markers` compares with every marker that was seen. `held_out` compares with markers that the solver was
    not given: those same markers for a solver that was given none; each marker held out in its turn for one
    that assimilated them, null if it does not tell. Markers that were not seen are NaN.
    `to_truth` is null where the markers were measured, since nobody knows the fields of a real finger.
    """
    observations = comparison.observations
    return {
        "schema": SCHEMA,
        "design": comparison.design.definition(),
        "material": comparison.material.model_dump(),
        "load": comparison.load.model_dump(),
        "measurements": {
            "source": observations.label,
            "description": observations.source,
            "markers": int(observations.visible.sum()),
        },
        "warnings": list(comparison.warnings),
        "reference": comparison.reference.solver,
        "solvers": {
            evaluation.solver: _solver(evaluation, comparison) for evaluation in comparison.evaluations
        },
    }


def _solver(evaluation: Evaluation, comparison: Comparison) -> dict[str, Any]:
    observations, reference, truth = comparison.observations, comparison.reference, comparison.truth
    errors, held_out = marker_errors(evaluation, observations), held_out_errors(evaluation, observations)
    differences = reference_differences(evaluation, reference)
    return {
        "family": evaluation.family,
        "twin": evaluation.twin,
        "law": evaluation.law,
        "status": "converged" if evaluation.converged else "not converged",
        "message": evaluation.message,
        "seconds": float(evaluation.stats.get("seconds", math.nan)),
        "energy": evaluation.energy,
        "reaction": evaluation.reaction.tolist(),
        "stats": dict(evaluation.stats),
        "certificate": evaluation.certificate and evaluation.certificate.numbers(),
        "markers": {
            "in_sample": evaluation.in_sample,
            "ae_u": errors.ae_u.tolist(),
            "ae_v": errors.ae_v.tolist(),
            **_means(errors),
        },
        "held_out": held_out
        and {"ae_u": held_out.ae_u.tolist(), "ae_v": held_out.ae_v.tolist(), **_means(held_out)},
        "uncertainty": _own_uncertainty(evaluation),
        "to_reference": _differences(differences)
        | {"reference_uncertainty": reference.uncertainty and _differences(reference.uncertainty)},
        "to_truth": None if truth is None else _by_component(truth_differences(evaluation, truth)._asdict()),
        "force_to_truth_rel": None if truth is None else force_error(evaluation, truth),
    }


def _means(errors: MarkerErrors) -> dict[str, float]:
    return {name: getattr(errors, name) for name in MEANS}


def _own_uncertainty(evaluation: Evaluation) -> dict[str, Any] | None:
    own, markers = evaluation.uncertainty, evaluation.marker_uncertainty
    if own is None or markers is None:
        return None
    return {
        "energy_norm": math.sqrt(abs(own.energy)),
        "rel_l2_displacement": own.displacement.rel_l2,
        "rel_l2_von_mises": own.von_mises.rel_l2,
        "mae_markers": own.mae_markers,
        "markers_u": markers[:, 0].tolist(),
        "markers_v": markers[:, 1].tolist(),
    }


def _differences(differences: ReferenceDifferences) -> dict[str, Any]:
    return {
        "rel_l2_displacement": differences.displacement.rel_l2,
        "rel_l2_von_mises": differences.von_mises.rel_l2,
        "mae_markers": differences.mae_markers,
        "rel_energy": differences.energy,
        "displacement": differences.displacement._asdict(),
        "von_mises": differences.von_mises._asdict(),
        "stress": _by_component(differences.stress),
        "strain": _by_component(differences.strain),
    }


def _by_component(differences: Mapping[str, FieldDifference]) -> dict[str, dict[str, float]]:
    return {name: difference._asdict() for name, difference in differences.items()}

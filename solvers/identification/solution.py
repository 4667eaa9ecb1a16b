"""The solution of a solver that identifies contact, walls and law, from its fits."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from geometry.arrays import FloatArray
from solvers.assimilation.misfit import leave_one_out_displacements
from solvers.identification.field import STEP, IdentifiedField, Member, Snapshot
from solvers.identification.fit import PROBABLE, Fit, Identified
from solvers.identification.hypothesis import Unknowns
from solvers.identification.summary import (
    identified_force,
    identified_sentence,
    identified_stats,
    standard_errors,
)
from solvers.problem import Problem
from solvers.solution import Solution, Status, Uncertainty, unstable_phrase


def identified_solution(
    name: str,
    problem: Problem,
    found: Identified,
    stats: Mapping[str, float | int | str],
) -> Solution:
    """The solution of the most probable law, with deviations that the others widen.

    Args:
        name: The solver's name.
        problem: As it was given, with its observations.
        found: The fits.
        stats: Columns of the solution's `stats` beside those of the identification.
    """
    best, (missed, left_out) = found.best, residuals_by_marker(found)
    hypothesis = best.response.hypothesis
    unstable = best.model.unstable(best.response)
    sentence = identified_sentence(found, missed)
    if unstable:
        sentence = f"{unstable_phrase(unstable)}; {sentence}"
    field = IdentifiedField(
        [
            _member(fit, float(probability), problem)
            for fit, probability in zip(found.fits, found.probabilities, strict=True)
            if fit is best or probability >= PROBABLE
        ]
    )
    return Solution(
        solver=name,
        problem=_with_values(best.markers.unknowns, best.response.values, problem),
        field=field,
        energy=best.model.body.energy(best.response.state, hypothesis.lame, hypothesis.changes),
        reaction=hypothesis.force,
        status=Status(best.estimate.converged and best.exact and not unstable, sentence),
        stats={**stats, **identified_stats(found), "unstable_directions": unstable},
        left_out=leave_one_out_displacements(problem, left_out),
        uncertainty=Uncertainty(field.standard_deviation, field.von_mises_deviation),
        identified=identified_force(found),
    )


def residuals_by_marker(found: Identified) -> tuple[FloatArray, FloatArray]:
    """Misfit of the markers that were believed, and left-out residuals of all that were seen, (m, 2), mm.

    The first is computed minus observed; the second observed minus predicted without the marker, to first
    order for those that were believed.
    """
    best, estimate = found.best, found.best.estimate
    scale = estimate.inflation * best.reading.noise
    count = 2 * len(best.reading.kept)
    missed = (estimate.residuals * scale)[:count].reshape(-1, 2)
    left_out = np.zeros((len(best.reading.kept) + len(found.doubtful), 2))
    for place, marker in enumerate(best.reading.kept):
        rows = np.array([2 * place, 2 * place + 1])
        left_out[marker] = -estimate.left_out(rows) * scale[rows]
    for marker, off in found.doubtful.items():
        left_out[marker] = -off
    return missed, left_out


def _member(fit: Fit, probability: float, problem: Problem) -> Member:
    """The finger of a fit and its neighbours by a step of each independent standard error."""
    errors = STEP * standard_errors(fit.estimate)
    return Member(
        probability,
        _snapshot(fit, problem),
        [_snapshot(fit, problem, error) for error in errors.T],
        fit.response,
        fit.model,
        None if fit.coarser is None else _snapshot(fit.coarser, problem),
    )


def _snapshot(fit: Fit, problem: Problem, error: FloatArray | float = 0.0) -> Snapshot:
    """The finger with values that differ from those of a fit by (p,), to first order."""
    model, unknowns = fit.model, fit.model.unknowns
    there = model.extrapolated(fit.response, fit.response.values + error)
    return Snapshot(
        problem=_with_values(unknowns, there.values, problem),
        walls=unknowns.motion,
        changes=there.hypothesis.changes,
        clamp=there.motion,
        body=model.body,
        state=there.state,
    )


def _with_values(unknowns: Unknowns, values: FloatArray, problem: Problem) -> Problem:
    """The problem with the law and the moduli that were found."""
    own = unknowns.material(values)
    return replace(problem, material=own)

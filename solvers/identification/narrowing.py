"""Further measurements, and the interval of an identified force that each would leave, by the posterior.

A further observation of deviation one with sensitivities a leaves (C^-1 + a^T a)^-1 of a covariance C; what
is measured by itself, such as the walls or the frames of the pictures, is known exactly from then on.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.solvers.assimilation.misfit import boundary_distances
from pinnray.solvers.identification.field import STEP, shown_displacements
from pinnray.solvers.identification.fit import NORMAL, Fit
from pinnray.solvers.identification.unknowns import WALLS

CANDIDATES = 60
"""Places that are tried for a further marker."""
SCALE = 0.02
"""Standard deviation of a press on a kitchen scale, over the force."""
WORTH = 0.95
"""Largest part of the interval that what is worth its while leaves."""


class Remedy(NamedTuple):
    """A measurement, and the variance of the force that it would leave, (N/mm)^2."""

    name: str
    variance: float


def narrowing_phrase(fit: Fit, direction: FloatArray, others: float) -> str:
    """A sentence on what would narrow the interval of the force's component in a direction, (2,).

    `others` is the variance that the fit does not have, (N/mm)^2.
    """
    whole = sum(fit.posterior.variances(direction).values()) + others
    tried = sorted(_tried(fit, direction), key=lambda remedy: remedy.variance)
    left = [(each.name, float(np.sqrt((each.variance + others) / whole))) for each in tried]
    worth = [f"{name} (to {100 * part:.0f} %)" for name, part in left if part < WORTH]
    if not worth:
        return f"Nothing that was tried would narrow its interval to less than {100 * WORTH:.0f} %."
    return f"What would narrow its interval: {', '.join(worth)}."


def _tried(fit: Fit, direction: FloatArray) -> Iterator[Remedy]:
    found, unknowns, parts = fit.estimate, fit.model.unknowns, fit.posterior.variances(direction)
    names, whole = np.array(unknowns.names), sum(parts.values())
    wider = (found.quantile / NORMAL) ** 2
    slopes = fit.response.force_slopes @ direction * found.slopes
    posterior = wider * float(slopes @ found.covariance @ slopes)
    calibrated = sum(parts[name] for name in ("modulus", "third dimension", "corners"))
    weighed = (SCALE * float(fit.response.force @ direction)) ** 2
    yield Remedy(f"a press of this finger on a scale, to {100 * SCALE:.0f} %", whole - calibrated + weighed)

    def known(rows: BoolArray) -> float:
        """The variance where some unknowns, of mask (p,), are known exactly."""
        kept = found.covariance[~rows][:, ~rows]
        if rows.any():
            shared = found.covariance[~rows][:, rows]
            kept = kept - shared @ np.linalg.solve(found.covariance[np.ix_(rows, rows)], shared.T)
        return whole - posterior + wider * float(slopes[~rows] @ kept @ slopes[~rows])

    frames = np.char.startswith(names, "pressed") | np.char.startswith(names, "drawn")
    if frames.any():
        yield Remedy("fiducials and a fixed camera", known(frames))
    if (walls := np.isin(names, WALLS)).any():
        yield Remedy("walls that are measured", known(walls))
    points, moves = _places(fit)
    gained = moves @ (fit.response.force_slopes @ direction @ fit.posterior.errors)
    inner = np.eye(2) + np.einsum("mip,mjp->mij", moves, moves)
    less = np.einsum("mi,mi->m", gained, np.linalg.solve(inner, gained[..., None])[..., 0])
    if len(points):
        best = int(less.argmax())
        place = "({:.0f}, {:.0f})".format(*points[best])
        yield Remedy(f"another marker, at {place} mm", whole - float(less[best]))


def _places(fit: Fit) -> tuple[FloatArray, FloatArray]:
    """Places (m, 2), mm, in the drawn body where a marker would fit, and how far it moves there.

    That is by each of p independent errors of one standard deviation, over the error of a marker: (m, 2, p).
    """
    data, problem = fit.measurement, fit.model.unknowns.problem
    mesh, wider = problem.mesh, fit.estimate.quantile / NORMAL
    centres = mesh.at_centroids().points
    centres = centres[:: max(1, len(centres) // (10 * CANDIDATES))]
    centres = centres[boundary_distances(mesh, centres) > 0.9 * data.radius]
    centres = centres[:: max(1, len(centres) // CANDIDATES)]
    found, steps = fit.snapshots(problem)
    own, *others = shown_displacements([found, *steps], mesh.locate(centres))
    noise = wider * STEP * fit.estimate.inflation * float(np.median(data.deviations))
    return centres, np.stack([(other - own) / noise for other in others], axis=-1)

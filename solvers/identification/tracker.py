"""The force of the indenter in one frame of a video after another, from the tracked markers.

Every frame has all unknowns of the inverse problem: the contact's place, width and force, and the finger's
walls, clamp and Poisson's ratio. With the markers linearised about an equilibrium, y + A (z - z0) over the
standard deviations, the estimate of `pinnray.solvers.assimilation.estimation` is

    (A^T A / φ² + P) (z - m) = A^T (d - y + A (z0 - m)) / φ²

The equilibrium is kept until the markers have moved away from it, so that most frames of a slow motion cost
no factorisation. The finger does not change, and the frames with the largest motion determine it best: for
frames with less motion, they give the prior of the finger, their mean m and the precision P of one of them.
The contact has its drawn prior in every frame, because it may move.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from pinnray.geometry.finger.learned import Learned
from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.assimilation.estimation import Prior, inflation_of, quantile_of, values_of
from pinnray.solvers.assimilation.misfit import MIN_STANDARD_DEVIATION, radius_within
from pinnray.solvers.identification.fit import NORMAL, ForcePosterior
from pinnray.solvers.identification.model import MarkerData, MarkerModel, Response, ResponseModel
from pinnray.solvers.identification.unknowns import CONTACT, SHARE
from pinnray.solvers.solution import Estimated, stroke_axes

NEAR = 0.3
"""Motion of a marker, mm, over which the markers are linear: a curvature of one in some 30 mm, the thickness
of a finger, leaves 0.002 mm."""
GROWTH = 1.02
"""Motion of the markers, over the largest so far, from which a frame replaces the knowledge of the finger.

Frames with less, down to the inverse of this, join the mean.
"""
FEWEST = 3
"""Markers that must be seen for a force: six numbers for the four of the contact."""


@dataclass(frozen=True, eq=False)
class ForceReading:
    """The force in a frame, with intervals of `LEVEL`."""

    force: Estimated  # Of the indenter along its stroke, N/mm; without an estimate NaN, -inf and inf
    tangential_force: Estimated  # The same across it, see `stroke_axes`
    # Abscissa on the drawn front at which the force acts, eccentricity included, mm; without an estimate NaN
    # and the whole front
    position: Estimated
    inflation: float  # φ; above one, neither the finger nor noise explains the markers
    evaluations: int  # Equilibria that were computed
    seconds: float
    status: str  # Remarks in words; empty if there are none
    # Of the force, (N/mm)^2, by what it comes from; see `ForcePosterior`
    variances: Mapping[str, float] = field(default_factory=dict)


class _Linearised(NamedTuple):
    """The markers about an equilibrium: z (p,), displacements (2 m,), mm, and their derivatives (2 m, p)."""

    z: FloatArray
    predicted: FloatArray
    slopes: FloatArray
    response: Response  # The equilibrium


class _Found(NamedTuple):
    """Estimate of z, shape (p,), and what it rests on."""

    z: FloatArray
    posterior: ForcePosterior  # With the response at the last equilibrium


class ForceTracker:
    """Estimates the force in one frame after another; every frame starts from the last one.

    Args:
        model: The finger, with `normal_force` and `position` among its unknowns.
        points: The m markers at rest, shape (m, 2), mm, in the drawn body.
        radius: Of their discs, mm; less is taken where one is nearer to the boundary.
        stiffness: Of the finger over that of the model.
    """

    def __init__(
        self, model: ResponseModel, points: FloatArray, radius: float, stiffness: float = 1.0
    ) -> None:
        self._unknowns, names = model.unknowns, model.unknowns.names
        self._stiffness, self._model, self.law = stiffness, model, model.unknowns.problem.material.law
        self._parameters = model.unknowns.parameters(model.flexibility())
        self._bounds = tuple(np.array([parameter.bounds for parameter in self._parameters]).T)
        still, inside = np.zeros_like(points), radius_within(model.unknowns.problem.mesh, points, radius)
        measurement = MarkerData(points, still, still, inside)
        self._markers = MarkerModel(model, measurement)
        self._of_finger = ~np.isin(names, (*CONTACT, SHARE, *model.unknowns.feet.names))
        self._drawn = model.unknowns.prior(self._parameters)
        self._known, self._learnt = self._drawn, 0
        self._largest = 0.0  # root mean square motion of the markers, mm
        rest = self._linearised(np.zeros(len(names)))
        if rest is None:
            raise UserError("the finger has no equilibrium at rest")
        self._last = rest

    def update(self, displacements: FloatArray, deviations: FloatArray, visible: BoolArray) -> ForceReading:
        """The force in a frame.

        Args:
            displacements: Of the markers since rest, shape (m, 2), mm; any value where one is hidden.
            deviations: Their standard deviations, shape (m, 2), mm; `MIN_STANDARD_DEVIATION` at least.
            visible: Mask of the markers that were seen, shape (m,).
        """
        started, self._evaluations = time.perf_counter(), 0
        reading = self._updated(displacements, deviations, visible)
        return replace(reading, evaluations=self._evaluations, seconds=time.perf_counter() - started)

    @property
    def learned(self) -> Learned | None:
        """What the frames with the largest motion say of the finger."""
        covariance = np.linalg.inv(self._known.precision)
        return self._unknowns.learned(self._parameters, self._known.mean, covariance)

    def _updated(self, displacements: FloatArray, deviations: FloatArray, visible: BoolArray) -> ForceReading:
        if (seen := int(visible.sum())) < FEWEST:
            return self._unknown(f"{seen} of {len(visible)} markers are seen, too few for a force")
        rows = np.repeat(visible, 2)
        observed = displacements.ravel()[rows]
        noise = np.maximum(deviations.ravel()[rows], MIN_STANDARD_DEVIATION)
        moved = float(np.sqrt((displacements[visible] ** 2).sum(axis=1).mean()))
        grown, near = moved > GROWTH * self._largest, GROWTH * moved > self._largest
        found = self._searched(self._drawn if near else self._known, rows, observed, noise)
        if found is not None and near:
            self._learn(found, anew=grown)
            if grown:
                self._largest = moved
            else:
                found = self._searched(self._known, rows, observed, noise)
        if found is None:
            return self._unknown("no equilibrium of the finger is near the markers")
        remarks = []
        if not visible.all():
            hidden = ", ".join(str(number + 1) for number in np.flatnonzero(~visible))
            remarks.append(f"hidden: marker {hidden}")
        if (off := found.posterior.inflation) > 1:
            remarks.append(f"the markers are {off:.2g} times as far off as noise explains")
        return self._reading(found, "; ".join(remarks))

    def _searched(
        self, prior: Prior, rows: BoolArray, observed: FloatArray, noise: FloatArray
    ) -> _Found | None:
        """The estimate; None if no equilibrium is found near it."""
        for _ in range(17):  # equilibria: enough for a jump from rest by forty millimetres
            last = self._last
            slopes = last.slopes[rows] / noise[:, None]
            found = self._posterior(prior, slopes, (last.predicted[rows] - observed) / noise)
            motion = (last.slopes @ (found.z - last.z)).reshape(-1, 2)
            longest = float(np.linalg.norm(motion, axis=1).max())
            if longest <= NEAR:
                return found
            share = min(1.0, 3.0 / longest)  # no marker moves by more than 3 mm in one step
            for _ in range(4):
                if (reached := self._linearised(last.z + share * (found.z - last.z))) is not None:
                    break
                share /= 2
            else:
                return None
            self._last = reached
            self._evaluations += 1
        return None

    def _posterior(self, prior: Prior, slopes: FloatArray, residuals: FloatArray) -> _Found:
        """The minimum for residuals (n,) over σ at the last equilibrium and their derivatives (n, p)."""
        root, inflation = prior.root, 1.0
        observed = slopes @ self._last.z - residuals
        for _ in range(20):  # φ is known to a thousandth much earlier
            rows = np.vstack([slopes / inflation, root])
            right = np.concatenate([observed / inflation, root @ prior.mean])
            z = np.asarray(lsq_linear(rows, right, self._bounds, method="bvls").x)
            freedom = prior.freedom(slopes / inflation)
            used, inflation = inflation, inflation_of(slopes @ z - observed, freedom)
            if abs(inflation / used - 1) < 1e-3:
                break
        covariance, (_, scales) = np.linalg.inv(rows.T @ rows), values_of(self._parameters, z)
        own = prior, covariance, used, quantile_of(used, freedom), scales
        return _Found(z, ForcePosterior(self._model, self._last.response, *own))

    def _linearised(self, z: FloatArray) -> _Linearised | None:
        """The markers about the equilibrium at z; None if there is none.

        The tolerance of the Newton step leaves about its square, no more than `NEAR` leaves.
        """
        values, derivatives = values_of(self._parameters, z)
        if (response := self._model.response(values, tolerance=0.02)) is None:
            return None
        predicted, slopes = self._markers.predicted(response)
        return _Linearised(z, predicted, slopes * derivatives, response)

    def _learn(self, found: _Found, *, anew: bool) -> None:
        """Make the finger in a frame the prior of other frames, or average it with the prior.

        The covariance stays one frame's: the errors of a camera and of the model are common to all.
        """
        self._learnt = 1 if anew else self._learnt + 1
        mean, precision = np.where(self._of_finger, found.z, 0.0), self._known.precision
        if anew:
            finger = np.ix_(self._of_finger, self._of_finger)
            precision = self._drawn.precision.copy()
            precision[finger] = np.linalg.inv(found.posterior.covariance[finger])
        else:
            mean = self._known.mean + (mean - self._known.mean) / self._learnt
        self._known = Prior(mean, precision)

    def _reading(self, found: _Found, status: str) -> ForceReading:
        values, _ = values_of(self._parameters, found.z)
        response = self._model.extrapolated(self._last.response, values)
        posterior, axes = (
            found.posterior._replace(response=response),
            stroke_axes(self._unknowns.problem.load),
        )
        stroke, side = (self._stiffness * axis for axis in axes)
        place, around = posterior.place
        ends = np.clip(place + NORMAL * around * np.array([-1.0, 1.0]), *self._unknowns.traction.ends)
        return replace(
            self._unknown(status),
            force=_estimated(*posterior.component(stroke)),
            tangential_force=_estimated(*posterior.component(side)),
            position=Estimated(place, float(ends[0]), float(ends[1])),
            variances=posterior.variances(stroke),
            inflation=found.posterior.inflation,
        )

    def _unknown(self, status: str) -> ForceReading:
        """A reading without an estimate."""
        none, force = np.nan, Estimated(np.nan, -np.inf, np.inf)
        place = Estimated(none, *self._unknowns.traction.ends)
        return ForceReading(force, force, place, none, 0, 0.0, status)


def _estimated(value: float, deviation: float) -> Estimated:
    half = NORMAL * deviation
    return Estimated(value, value - half, value + half)

"""Posterior of `statfem` and `gp`: the model d = ρ B u + δ + e of the observations, conditioned on markers.

See `pinnray.solvers.statistics.statistical_fem` for the random variables and the source.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_solve
from scipy.optimize import minimize
from threadpoolctl import threadpool_limits

from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.assimilation.picture_frames import FramedData, FreePictures
from pinnray.solvers.energy_and_force import energy_and_force
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import DisplacementField, Solution, Status, Uncertainty
from pinnray.solvers.statistics.kernel_field import (
    KernelField,
    MarkerPrediction,
    correlation,
    derivative_by_log_length,
)

SPREADS, LENGTHS, FACTORS = (1e-4, 100.0), (2.0, 500.0), (0.2, 5.0)
"""Search ranges of the amplitudes, mm, the length, mm, and ρ."""
START = [[1.0, 0.5, 0.5, length] for length in (10.0, 30.0, 100.0)]
"""Starting points of the search; the likelihood can have several maxima."""


@dataclass(frozen=True, eq=False)
class StatFemData:
    """Observations at m markers, and finite elements for k prescribed components."""

    points: FloatArray  # Shape (m, 2), mm
    observed: FloatArray  # d, shape (m, 2), mm
    deviations: FloatArray  # Standard deviations of e, shape (m, 2), mm
    frames: FloatArray  # Errors by unit changes of the pictures' frames, shape (p, m, 2), mm
    # Displacements of the finite elements at the points by unit displacements of the contact, shape (k, m, 2)
    shapes: FloatArray
    load: FloatArray  # Nominal displacements of the contact, shape (k,), mm
    load_deviation: float  # Their standard deviation, mm

    def without(self, marker: int) -> "StatFemData":
        """The other markers' data."""
        kept = np.arange(len(self.points)) != marker
        return replace(
            self,
            points=self.points[kept],
            observed=self.observed[kept],
            deviations=self.deviations[kept],
            frames=self.frames[:, kept],
            shapes=self.shapes[:, kept],
        )


class Hyperparameters(NamedTuple):
    """Factor ρ; amplitudes and lengths of δ in u and v, each of shape (2,), mm."""

    factor: float
    amplitudes: FloatArray
    lengths: FloatArray


@dataclass(frozen=True, eq=False)
class Posterior:
    """ρ u + δ given the markers."""

    data: StatFemData
    constants: Hyperparameters  # Of the largest marginal likelihood
    coefficients: FloatArray  # Inverse covariance of d times (d minus the prior mean), shape (m, 2), 1/mm
    cholesky: FloatArray  # Cholesky factor of that covariance, shape (2 m, 2 m)
    log_evidence: float  # Logarithm of the marginal likelihood of d

    @classmethod
    def of(cls, data: StatFemData) -> "Posterior":
        """Find the hyperparameters, and condition on the markers."""
        bounds = np.log([FACTORS, SPREADS, SPREADS, LENGTHS])
        with threadpool_limits(1, user_api="blas"):  # on small matrices its threads wait for one another
            found = [
                minimize(
                    partial(minus_log_likelihood, data),
                    np.log(values),
                    jac=True,
                    method="L-BFGS-B",
                    bounds=bounds,
                )
                for values in START
            ]
        best = min(found, key=lambda result: result.fun)
        return cls.given(data, _exponentials(best.x))

    @classmethod
    def given(cls, data: StatFemData, constants: Hyperparameters) -> "Posterior":
        """Condition on the markers with hyperparameters."""
        cholesky, residual, coefficients = _condition(data, constants)
        misfit = float(0.5 * residual @ coefficients) + log_root_determinant(cholesky)
        log_evidence = -misfit - len(data.points) * np.log(2 * np.pi)
        return cls(data, constants, coefficients.reshape(-1, 2), cholesky, log_evidence)

    @property
    def load(self) -> FloatArray:
        """Posterior mean of the contact's displacement, shape (k,), mm."""
        pulled = np.einsum("kgc,gc->k", self.data.shapes, self.coefficients)
        return np.asarray(self.data.load + self.data.load_deviation**2 * self.constants.factor * pulled)

    @property
    def frames(self) -> tuple[FloatArray, FloatArray]:
        """Mean (p,) and covariance (p, p) of the frames' standardised values."""
        flat = self.data.frames.reshape(len(self.data.frames), 2 * len(self.data.points))
        mean = flat @ self.coefficients.ravel()
        return mean, np.eye(len(flat)) - flat @ cho_solve((self.cholesky, True), flat.T)

    @property
    def discrepancy(self) -> KernelField:
        """Posterior mean of δ."""
        coefficients = self.constants.amplitudes**2 * self.coefficients
        return KernelField(self.data.points, coefficients, self.constants.lengths)

    def at(
        self, points: FloatArray, shapes: FloatArray, frames: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Mean, mm, and variance, mm², at points (n, 2) where `shapes` is of shape (k, n, 2): each (n, 2).

        With `frames`, of shape (p, n, 2), of what is observed there, without the errors e.
        """
        data, (factor, amplitudes, _) = self.data, self.constants
        between = _covariance(data, self.constants, points, shapes)
        mean = factor * np.einsum("k,knc->nc", data.load, shapes)
        mean = mean + (between @ self.coefficients.ravel()).reshape(-1, 2)
        prior = (factor * data.load_deviation) ** 2 * (shapes**2).sum(axis=0) + amplitudes**2
        if frames is not None:
            shared = np.einsum("pnc,pgd->ncgd", frames, data.frames).reshape(between.shape)
            mean = mean + (shared @ self.coefficients.ravel()).reshape(-1, 2)
            between, prior = between + shared, prior + (frames**2).sum(axis=0)
        known = (between * cho_solve((self.cholesky, True), between.T).T).sum(axis=1).reshape(-1, 2)
        return mean, np.maximum(prior - known, 0.0)


def predicted(others: Posterior, data: StatFemData, pictures: FreePictures, marker: int) -> MarkerPrediction:
    """What the pictures show of a marker, by the posterior of the others."""
    one = [marker]
    mean, _ = others.at(data.points[one], data.shapes[:, one])
    _, variance = others.at(data.points[one], data.shapes[:, one], data.frames[:, one])
    shown = pictures.at(others.frames[0]).shown(data.points[one], mean)
    return shown[0], np.sqrt(variance[0] + data.deviations[marker] ** 2)


@dataclass(frozen=True, eq=False)
class StatFemField:
    """The posterior as a displacement field."""

    posterior: Posterior
    shapes: Sequence[DisplacementField]  # Finite elements for k unit displacements of the contact

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Posterior mean, shape (n, 2), mm."""
        return self._by_load(self._own(location)) + self.posterior.discrepancy.displacement(location)

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Gradient du_i/dx_j of the mean, shape (n, 2, 2)."""
        own = [shape.gradient(location) for shape in self.shapes]
        gradients = np.reshape(own, (len(own), len(location.points), 2, 2))
        return self._by_load(gradients) + self.posterior.discrepancy.gradient(location)

    def standard_deviation(self, location: LocatedPoints) -> FloatArray:
        """Standard deviation of the displacement, shape (n, 2), mm."""
        return np.asarray(np.sqrt(self.posterior.at(location.points, self._own(location))[1]))

    def shown_deviation(self, pictures: FreePictures, location: LocatedPoints) -> FloatArray:
        """Standard deviation of what pictures show of the displacement, shape (n, 2), mm."""
        z, points = self.posterior.frames[0], location.points
        there = replace(
            pictures, points=points, shown=pictures.at(z).shown(points, self.displacement(location))
        )
        frames = there.about(z).frames
        return np.asarray(np.sqrt(self.posterior.at(points, self._own(location), frames)[1]))

    def _own(self, location: LocatedPoints) -> FloatArray:
        """Displacements by the shapes, shape (k, n, 2)."""
        own = [shape.displacement(location) for shape in self.shapes]
        return np.reshape(own, (len(own), len(location.points), 2))

    def _by_load(self, own: FloatArray) -> FloatArray:
        return np.asarray(np.tensordot(self.posterior.constants.factor * self.posterior.load, own, axes=1))


def framed_posterior(pictures: FreePictures, conditioned: Callable[[FramedData], Posterior]) -> Posterior:
    """The posterior with the pictures' frames found, by one for linearised observations."""
    return conditioned(pictures.about(pictures.found(lambda framed: conditioned(framed).frames[0])))


def posterior_solution(
    solver: str,
    problem: Problem,
    field: StatFemField,
    pictures: FreePictures,
    said: str,
    stats: Mapping[str, float | int | str],
) -> Solution:
    """A posterior as a solution, with its deviations.

    Args:
        solver: Its name.
        problem: What is solved.
        field: The posterior.
        pictures: Of the markers.
        said: The status in words.
        stats: `seconds` and other columns of the solver.
    """
    energy, reaction = energy_and_force(problem, field, 4)
    frames, free = field.posterior.frames, bool(pictures.parameters)
    return Solution(
        solver=solver,
        problem=problem,
        field=field,
        energy=energy,
        reaction=reaction,
        status=Status(True, said),
        stats={**stats, "log_evidence": field.posterior.log_evidence, **pictures.numbers(*frames)},
        uncertainty=Uncertainty(
            field.standard_deviation, shown=partial(field.shown_deviation, pictures) if free else None
        ),
        pictures=pictures.at(frames[0]) if free else None,
    )


def _exponentials(parameters: FloatArray) -> Hyperparameters:
    factor, u, v, length = np.exp(parameters)
    return Hyperparameters(float(factor), np.array([u, v]), np.full(2, length))


def minus_log_likelihood(data: StatFemData, parameters: FloatArray) -> tuple[float, FloatArray]:
    """Of hyperparameters by their logarithms, (4,), without its constant, and its derivatives by these, (4,).

    With the covariance C of d, d minus its prior mean r and w = C^-1 r it is (r . w + ln det C) / 2, whose
    derivative by a parameter is (C^-1 - w w^T) : dC / 2 + w . dr.
    """
    constants = _exponentials(parameters)
    factor, amplitudes, (length, _) = constants
    cholesky, residual, coefficients = _condition(data, constants)
    value = float(0.5 * residual @ coefficients) + log_root_determinant(cholesky)
    inverse = cho_solve((cholesky, True), np.eye(len(residual)))
    count = len(data.points)
    by_covariance = 0.5 * (inverse - np.outer(coefficients, coefficients)).reshape(count, 2, count, 2)
    spread = (factor * data.load_deviation) ** 2
    by_load = spread * np.einsum("kgc,khd,gchd->", data.shapes, data.shapes, by_covariance)
    mean = factor * np.einsum("k,kgc,gc->", data.load, data.shapes, coefficients.reshape(count, 2))
    alike = np.einsum("gchc->cgh", by_covariance) * amplitudes[:, None, None] ** 2
    kernel, longer = (
        find(data.points, data.points, length) for find in (correlation, derivative_by_log_length)
    )
    by_amplitudes = (alike * kernel).sum(axis=(1, 2))
    return value, np.array([2 * by_load - mean, *(2 * by_amplitudes), (alike * longer).sum()])


def log_root_determinant(cholesky: FloatArray) -> float:
    """Logarithm of the square root of the determinant of C = L Lᵀ, from L, shape (n, n).

    By the C library's logarithm: NumPy's of a diagonal differs in its last bit with the memory that happens
    to follow the matrix, and the search for the hyperparameters turns that into a millionth of them.
    """
    return sum(map(math.log, cholesky.diagonal().tolist()))


def _condition(data: StatFemData, constants: Hyperparameters) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cholesky factor of the covariance C of d, (2 m, 2 m); d minus its prior mean r, mm; C^-1 r, 1/mm."""
    covariance = _covariance(data, constants, data.points, data.shapes)
    flat = data.frames.reshape(len(data.frames), covariance.shape[0])
    covariance = covariance + np.diag(data.deviations.ravel() ** 2) + flat.T @ flat
    mean = constants.factor * np.einsum("k,kgc->gc", data.load, data.shapes)
    residual = (data.observed - mean).ravel()
    cholesky = np.linalg.cholesky(covariance)
    return cholesky, residual, cho_solve((cholesky, True), residual)


def _covariance(
    data: StatFemData, constants: Hyperparameters, points: FloatArray, shapes: FloatArray
) -> FloatArray:
    """Prior covariance of ρ u + δ between n points and the markers, mm²: (2 n, 2 m), u and v by turns."""
    by_load = np.einsum("knc,kgd->ncgd", shapes, data.shapes) * (constants.factor * data.load_deviation) ** 2
    kernels = {length: correlation(points, data.points, length) for length in constants.lengths}
    kernel = np.stack([kernels[length] for length in constants.lengths])
    discrepancy = np.einsum("cng,cd->ncgd", kernel, np.diag(constants.amplitudes**2))
    return np.asarray((by_load + discrepancy).reshape(2 * len(points), 2 * len(data.points)))

"""Posterior of `statfem`: the model d = ρ B u + δ + e of the observations, conditioned on markers.

See `solvers.statistics.statistical_fem` for the random variables and the source.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_solve
from scipy.optimize import minimize
from threadpoolctl import threadpool_limits

from geometry.arrays import FloatArray
from geometry.mesh.point_location import LocatedPoints
from solvers.solution import DisplacementField
from solvers.statistics.kernel_field import Kernel, KernelField, correlation

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
    # Displacements of the finite elements at the points by unit displacements of the contact, shape (k, m, 2)
    shapes: FloatArray
    load: FloatArray  # Nominal displacements of the contact, shape (k,), mm
    load_deviation: float  # Their standard deviation, mm
    kernel: Kernel  # Covariance function of δ

    def without(self, marker: int) -> "StatFemData":
        """The other markers' data."""
        kept = np.arange(len(self.points)) != marker
        return replace(
            self,
            points=self.points[kept],
            observed=self.observed[kept],
            deviations=self.deviations[kept],
            shapes=self.shapes[:, kept],
        )


class Hyperparameters(NamedTuple):
    """Factor ρ; amplitudes of δ, shape (2,), mm; its length, mm."""

    factor: float
    amplitudes: FloatArray
    length: float


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

        def minus_log_likelihood(parameters: FloatArray) -> float:
            cholesky, residual, coefficients = _condition(data, _exponentials(parameters))
            return float(0.5 * residual @ coefficients) + log_root_determinant(cholesky)

        bounds = np.log([FACTORS, SPREADS, SPREADS, LENGTHS])
        with threadpool_limits(1, user_api="blas"):  # on small matrices its threads wait for one another
            found = [
                minimize(minus_log_likelihood, np.log(values), method="L-BFGS-B", bounds=bounds)
                for values in START
            ]
        best = min(found, key=lambda result: result.fun)
        constants = _exponentials(best.x)
        cholesky, _, coefficients = _condition(data, constants)
        log_evidence = -float(best.fun) - len(data.points) * np.log(2 * np.pi)
        return cls(data, constants, coefficients.reshape(-1, 2), cholesky, log_evidence)

    @property
    def load(self) -> FloatArray:
        """Posterior mean of the contact's displacement, shape (k,), mm."""
        pulled = np.einsum("kgc,gc->k", self.data.shapes, self.coefficients)
        return np.asarray(self.data.load + self.data.load_deviation**2 * self.constants.factor * pulled)

    @property
    def discrepancy(self) -> KernelField:
        """Posterior mean of δ."""
        coefficients = self.constants.amplitudes**2 * self.coefficients
        lengths = np.full(2, self.constants.length)
        return KernelField(self.data.points, coefficients, lengths, self.data.kernel)

    def at(self, points: FloatArray, shapes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean, mm, and variance, mm², at points (n, 2) where `shapes` is of shape (k, n, 2): each (n, 2)."""
        data, (factor, amplitudes, _) = self.data, self.constants
        between = _covariance(data, self.constants, points, shapes)
        mean = factor * np.einsum("k,knc->nc", data.load, shapes)
        mean = mean + (between @ self.coefficients.ravel()).reshape(-1, 2)
        prior = (factor * data.load_deviation) ** 2 * (shapes**2).sum(axis=0) + amplitudes**2
        known = (between * cho_solve((self.cholesky, True), between.T).T).sum(axis=1).reshape(-1, 2)
        return mean, np.maximum(prior - known, 0.0)


@dataclass(frozen=True, eq=False)
class StatFemField:
    """The posterior as a displacement field."""

    posterior: Posterior
    shapes: Sequence[DisplacementField]  # Finite elements for k unit displacements of the contact

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Posterior mean, shape (n, 2), mm."""
        own = np.stack([shape.displacement(location) for shape in self.shapes])
        return self._by_load(own) + self.posterior.discrepancy.displacement(location)

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Gradient du_i/dx_j of the mean, shape (n, 2, 2)."""
        own = np.stack([shape.gradient(location) for shape in self.shapes])
        return self._by_load(own) + self.posterior.discrepancy.gradient(location)

    def standard_deviation(self, location: LocatedPoints) -> FloatArray:
        """Standard deviation of the displacement, shape (n, 2), mm."""
        own = np.stack([shape.displacement(location) for shape in self.shapes])
        return np.asarray(np.sqrt(self.posterior.at(location.points, own)[1]))

    def _by_load(self, own: FloatArray) -> FloatArray:
        return np.asarray(np.tensordot(self.posterior.constants.factor * self.posterior.load, own, axes=1))


def _exponentials(parameters: FloatArray) -> Hyperparameters:
    factor, u, v, length = np.exp(parameters)
    return Hyperparameters(float(factor), np.array([u, v]), float(length))


def log_root_determinant(cholesky: FloatArray) -> float:
    """Logarithm of the square root of the determinant of C = L Lᵀ, from L, shape (n, n).

    By the C library's logarithm: NumPy's of a diagonal differs in its last bit with the memory that happens
    to follow the matrix, and the search for the hyperparameters turns that into a millionth of them.
    """
    return sum(map(math.log, cholesky.diagonal().tolist()))


def _condition(data: StatFemData, constants: Hyperparameters) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cholesky factor of the covariance C of d, (2 m, 2 m); d minus its prior mean r, mm; C^-1 r, 1/mm."""
    covariance = _covariance(data, constants, data.points, data.shapes)
    covariance = covariance + np.diag(data.deviations.ravel() ** 2)
    mean = constants.factor * np.einsum("k,kgc->gc", data.load, data.shapes)
    residual = (data.observed - mean).ravel()
    cholesky = np.linalg.cholesky(covariance)
    return cholesky, residual, cho_solve((cholesky, True), residual)


def _covariance(
    data: StatFemData, constants: Hyperparameters, points: FloatArray, shapes: FloatArray
) -> FloatArray:
    """Prior covariance of ρ u + δ between n points and the markers, mm²: (2 n, 2 m), u and v by turns."""
    by_load = np.einsum("knc,kgd->ncgd", shapes, data.shapes) * (constants.factor * data.load_deviation) ** 2
    kernel = correlation(points, data.points, constants.length, data.kernel)
    discrepancy = np.einsum("ng,cd->ncgd", kernel, np.diag(constants.amplitudes**2))
    return np.asarray((by_load + discrepancy).reshape(2 * len(points), 2 * len(data.points)))

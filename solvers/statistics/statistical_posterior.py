"""Posterior of `statfem`: the model d = ρ B u + δ + e of the observations, conditioned on markers.

See `solvers.statistics.statistical_fem` for the random variables and the source.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve
from scipy.optimize import minimize
from threadpoolctl import threadpool_limits

from geometry.arrays import FloatArray, IntArray
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


@dataclass(frozen=True, eq=False)
class Hyperparameters:
    """Factor ρ; amplitudes of δ, shape (2,), mm; its length, mm."""

    factor: float
    amplitudes: FloatArray
    length: float

    @classmethod
    def of(cls, parameters: FloatArray) -> "Hyperparameters":
        """From their logarithms, shape (4,)."""
        factor, u, v, length = np.exp(parameters)
        return cls(float(factor), np.array([u, v]), float(length))


@dataclass(frozen=True, eq=False)
class Posterior:
    """ρ u + δ given some of the markers."""

    data: StatFemData  # All markers
    given: IntArray  # Numbers of the markers conditioned on, shape (g,)
    constants: Hyperparameters  # Hyperparameters of the largest marginal likelihood
    coefficients: FloatArray  # Inverse covariance of d times (d minus the prior mean), shape (g, 2), 1/mm
    cholesky: FloatArray  # Cholesky factor of that covariance, shape (2 g, 2 g)
    log_evidence: float  # Logarithm of the marginal likelihood of d

    @classmethod
    def of(cls, data: StatFemData, given: IntArray) -> "Posterior":
        """Find the hyperparameters from some of the markers alone."""

        def minus_log_likelihood(parameters: FloatArray) -> float:
            cholesky, residual, coefficients = _condition(data, given, Hyperparameters.of(parameters))
            return float(0.5 * residual @ coefficients) + log_root_determinant(cholesky)

        bounds = np.log([FACTORS, SPREADS, SPREADS, LENGTHS])
        with threadpool_limits(1, user_api="blas"):  # on small matrices its threads wait for one another
            found = [
                minimize(minus_log_likelihood, np.log(values), method="L-BFGS-B", bounds=bounds)
                for values in START
            ]
        best = min(found, key=lambda result: result.fun)
        constants = Hyperparameters.of(best.x)
        cholesky, _, coefficients = _condition(data, given, constants)
        log_evidence = -float(best.fun) - len(given) * np.log(2 * np.pi)
        return cls(data, given, constants, coefficients.reshape(-1, 2), cholesky, log_evidence)

    @property
    def load(self) -> FloatArray:
        """Posterior mean of the contact's displacement, shape (k,), mm."""
        pulled = np.einsum("kgc,gc->k", self.data.shapes[:, self.given], self.coefficients)
        return np.asarray(self.data.load + self.data.load_deviation**2 * self.constants.factor * pulled)

    @property
    def discrepancy(self) -> KernelField:
        """Posterior mean of δ."""
        centres, lengths = self.data.points[self.given], np.full(2, self.constants.length)
        coefficients = self.constants.amplitudes**2 * self.coefficients
        return KernelField(centres, coefficients, lengths, self.data.kernel)

    def at(self, points: FloatArray, shapes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean, mm, and variance, mm², at points (n, 2) where `shapes` is of shape (k, n, 2): each (n, 2)."""
        data, constants = self.data, self.constants
        others = (data.points[self.given], data.shapes[:, self.given])
        between = _covariance(data, constants, points, shapes, *others)
        mean = constants.factor * np.einsum("k,knc->nc", data.load, shapes)
        mean = mean + (between @ self.coefficients.ravel()).reshape(-1, 2)
        prior = (constants.factor * data.load_deviation) ** 2 * (shapes**2).sum(
            axis=0
        ) + constants.amplitudes**2
        known = (between * cho_solve((self.cholesky, True), between.T).T).sum(axis=1).reshape(-1, 2)
        return mean, np.maximum(prior - known, 0.0)


@dataclass(frozen=True, eq=False)
class StatFemField:
    """The posterior as a displacement field."""

    posterior: Posterior  # The posterior, conditioned on the markers
    # The finite elements' displacements by unit displacements of the contact, k of them
    shapes: tuple[DisplacementField, ...]

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


def log_root_determinant(cholesky: FloatArray) -> float:
    """Logarithm of the square root of the determinant of C = L Lᵀ, from L, shape (n, n).

    By the C library's logarithm: NumPy's of a diagonal differs in its last bit with the memory that happens
    to follow the matrix, and the search for the hyperparameters turns that into a millionth of them.
    """
    return sum(map(math.log, cholesky.diagonal().tolist()))


def _condition(
    data: StatFemData, given: IntArray, constants: Hyperparameters
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cholesky factor of the covariance C of d, (2 g, 2 g); d minus its prior mean r, mm; C^-1 r, 1/mm."""
    points, shapes = data.points[given], data.shapes[:, given]
    covariance = _covariance(data, constants, points, shapes, points, shapes)
    covariance = covariance + np.diag(data.deviations[given].ravel() ** 2)
    mean = constants.factor * np.einsum("k,kgc->gc", data.load, shapes)
    residual = (data.observed[given] - mean).ravel()
    cholesky = np.linalg.cholesky(covariance)
    return cholesky, residual, cho_solve((cholesky, True), residual)


def _covariance(
    data: StatFemData,
    constants: Hyperparameters,
    points: FloatArray,
    shapes: FloatArray,
    others: FloatArray,
    other_shapes: FloatArray,
) -> FloatArray:
    """Prior covariance of ρ u + δ between n points and g others, mm²: shape (2 n, 2 g), u and v by turns."""
    by_load = np.einsum("knc,kgd->ncgd", shapes, other_shapes) * (constants.factor * data.load_deviation) ** 2
    kernel = correlation(points, others, constants.length, data.kernel)
    discrepancy = np.einsum("ng,cd->ncgd", kernel, np.diag(constants.amplitudes**2))
    return np.asarray((by_load + discrepancy).reshape(2 * len(points), 2 * len(others)))

"""What `statfem` knows a posteriori: the model of the data d = ρ B u + δ + e, conditioned on markers.

See `solvers.statistics.statistical_fem` for what is random in it, and for the source.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve
from scipy.optimize import minimize

from geometry.arrays import FloatArray, IntArray
from geometry.mesh.point_location import LocatedPoints
from solvers.solution import DisplacementField
from solvers.statistics.kernel_field import Kernel, KernelField, correlation

SPREADS, LENGTHS, FACTORS = (1e-4, 100.0), (2.0, 500.0), (0.2, 5.0)
"""Between what amplitudes, mm, length, mm, and ρ are looked for."""
START = [[1.0, 0.5, 0.5, length] for length in (10.0, 30.0, 100.0)]
"""Where the search begins; the likelihood can have several maxima."""


@dataclass(frozen=True, eq=False)
class Data:
    """What there is to learn from: m markers, k prescribed components.

    Attributes:
        points: Shape (m, 2), mm.
        observed: d, shape (m, 2), mm.
        deviations: Of e, shape (m, 2), mm.
        shapes: Displacements of the finite elements at the points by unit displacements of the contact, shape
            (k, m, 2).
        load: Nominal displacements of the contact, shape (k,), mm.
        load_deviation: Their standard deviation, mm.
        kernel: Of δ.
    """

    points: FloatArray
    observed: FloatArray
    deviations: FloatArray
    shapes: FloatArray
    load: FloatArray
    load_deviation: float
    kernel: Kernel


@dataclass(frozen=True, eq=False)
class Constants:
    """ρ; the amplitudes of δ, shape (2,), mm; its length, mm."""

    factor: float
    spreads: FloatArray
    length: float

    @classmethod
    def of(cls, parameters: FloatArray) -> "Constants":
        """From the logarithms, shape (4,), in which they are looked for."""
        factor, u, v, length = np.exp(parameters)
        return cls(float(factor), np.array([u, v]), float(length))


@dataclass(frozen=True, eq=False)
class Posterior:
    """ρ u + δ given some of the markers.

    Attributes:
        data: All markers.
        given: Which of them are conditioned on, shape (g,).
        constants: Those of the largest marginal likelihood.
        pulls: Inverse covariance of d times what the prior mean misses d by, shape (g, 2), 1/mm.
        factors: Cholesky's, of that covariance, shape (2 g, 2 g).
        log_evidence: Logarithm of the marginal likelihood of d.
    """

    data: Data
    given: IntArray
    constants: Constants
    pulls: FloatArray
    factors: FloatArray
    log_evidence: float

    @classmethod
    def of(cls, data: Data, given: IntArray) -> "Posterior":
        """Find the constants for some of the markers; the others have no part in it."""

        def minus_log_likelihood(parameters: FloatArray) -> float:
            factors, missed, pulls = _condition(data, given, Constants.of(parameters))
            return float(0.5 * missed @ pulls + np.log(np.diag(factors)).sum())

        bounds = np.log([FACTORS, SPREADS, SPREADS, LENGTHS])
        found = [
            minimize(minus_log_likelihood, np.log(values), method="L-BFGS-B", bounds=bounds)
            for values in START
        ]
        best = min(found, key=lambda result: result.fun)
        constants = Constants.of(best.x)
        factors, _, pulls = _condition(data, given, constants)
        log_evidence = -float(best.fun) - len(given) * np.log(2 * np.pi)
        return cls(data, given, constants, pulls.reshape(-1, 2), factors, log_evidence)

    @property
    def load(self) -> FloatArray:
        """Posterior mean of the contact's displacement, shape (k,), mm."""
        pulled = np.einsum("kgc,gc->k", self.data.shapes[:, self.given], self.pulls)
        return np.asarray(self.data.load + self.data.load_deviation**2 * self.constants.factor * pulled)

    @property
    def discrepancy(self) -> KernelField:
        """Posterior mean of δ."""
        coefficients = self.constants.spreads**2 * self.pulls
        centres, lengths = self.data.points[self.given], np.full(2, self.constants.length)
        return KernelField(centres, coefficients, lengths, self.data.kernel)

    def at(self, points: FloatArray, shapes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean, mm, and variance, mm², at points (n, 2) where `shapes` is of shape (k, n, 2): each (n, 2)."""
        data, constants = self.data, self.constants
        others = (data.points[self.given], data.shapes[:, self.given])
        across = _covariance(data, constants, points, shapes, *others)
        mean = constants.factor * np.einsum("k,knc->nc", data.load, shapes)
        mean = mean + (across @ self.pulls.ravel()).reshape(-1, 2)
        prior = (constants.factor * data.load_deviation) ** 2 * (shapes**2).sum(axis=0) + constants.spreads**2
        known = (across * cho_solve((self.factors, True), across.T).T).sum(axis=1).reshape(-1, 2)
        return mean, np.maximum(prior - known, 0.0)


@dataclass(frozen=True, eq=False)
class StatFemField:
    """The posterior as a displacement field.

    Attributes:
        posterior: At the markers.
        shapes: The finite elements' displacements by unit displacements of the contact, k of them.
    """

    posterior: Posterior
    shapes: tuple[DisplacementField, ...]

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Its mean, shape (n, 2), mm."""
        own = np.stack([shape.displacement(location) for shape in self.shapes])
        return self._by_load(own) + self.posterior.discrepancy.displacement(location)

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Gradient du_i/dx_j of the mean, shape (n, 2, 2)."""
        own = np.stack([shape.gradient(location) for shape in self.shapes])
        return self._by_load(own) + self.posterior.discrepancy.gradient(location)

    def standard_deviation(self, location: LocatedPoints) -> FloatArray:
        """Of the displacement, shape (n, 2), mm."""
        own = np.stack([shape.displacement(location) for shape in self.shapes])
        return np.asarray(np.sqrt(self.posterior.at(location.points, own)[1]))

    def _by_load(self, own: FloatArray) -> FloatArray:
        return np.asarray(np.tensordot(self.posterior.constants.factor * self.posterior.load, own, axes=1))


def _condition(
    data: Data, given: IntArray, constants: Constants
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cholesky factor of the covariance of d, (2 g, 2 g); what the mean misses d by, mm; both's quotient."""
    points, shapes = data.points[given], data.shapes[:, given]
    covariance = _covariance(data, constants, points, shapes, points, shapes)
    covariance = covariance + np.diag(data.deviations[given].ravel() ** 2)
    mean = constants.factor * np.einsum("k,kgc->gc", data.load, shapes)
    missed = (data.observed[given] - mean).ravel()
    factors = np.linalg.cholesky(covariance)
    return factors, missed, cho_solve((factors, True), missed)


def _covariance(
    data: Data,
    constants: Constants,
    points: FloatArray,
    shapes: FloatArray,
    others: FloatArray,
    other_shapes: FloatArray,
) -> FloatArray:
    """Prior covariance of ρ u + δ between n points and g others, mm²: shape (2 n, 2 g), u and v by turns."""
    by_load = np.einsum("knc,kgd->ncgd", shapes, other_shapes) * (constants.factor * data.load_deviation) ** 2
    kernel = correlation(points, others, constants.length, data.kernel)
    lacking = np.einsum("ng,cd->ncgd", kernel, np.diag(constants.spreads**2))
    return np.asarray((by_load + lacking).reshape(2 * len(points), 2 * len(others)))

"""Parameters from observations: weighted least squares with a prior, and what the observations say of each.

With predictions y(θ), observations d of standard deviations σ, and a Gaussian prior with the mean θ0 and the
standard deviations s, of θ or of its logarithm, the estimate minimises

    Σ ((y(θ) - d) / φ σ)^2 + Σ z^2        z = (θ - θ0) / s   or   log(θ / θ0) / s

φ is one where noise of the size σ explains the misfit. Where it does not, at a level of 95 % of χ^2, it is
the root of the misfit over its degrees of freedom, found together with θ: a model that is wrong by φ σ must
not be believed to σ. With A = (dy/dz) / φ σ the covariance of z is (A^T A + 1)^-1.

Sources: A. Tarantola, Inverse Problem Theory, SIAM 2005, chapter 3 (estimate, covariance,
resolution); R. T. Birge, The calculation of errors by the method of least squares, Phys. Rev. 40 (1932)
207-227 (φ).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import chi2, norm, t

from geometry.arrays import BoolArray, FloatArray, IntArray

LEVEL = 0.95
"""Of confidence intervals, and of the test whether noise explains the misfit."""

RESOLVED = 0.5
"""Least share of what is known of a parameter that must come from the observations."""

ROUNDS = 20
"""Estimates at most until φ settles, which it has done when it changes by less than `SETTLED`."""
SETTLED = 0.01

Prediction = tuple[FloatArray, FloatArray]
"""Predictions, shape (n,), and their derivatives by the parameters, shape (n, p)."""


@dataclass(frozen=True)
class Parameter:
    """A parameter that is to be found.

    Attributes:
        name: What it is called.
        unit: Of its value; empty for a pure number.
        start: Middle of its prior: what it is taken for before anything is observed.
        scale: Standard deviation of the prior, of the value or, if `logarithmic`, of its logarithm.
        low: Least value that it can have.
        high: Largest value.
        logarithmic: Whether the prior is of the logarithm: for what is positive and known to a factor.
    """

    name: str
    unit: str
    start: float
    scale: float
    low: float = -np.inf
    high: float = np.inf
    logarithmic: bool = False

    def value(self, z: float | FloatArray) -> FloatArray:
        """The value, z standard deviations from the middle."""
        z = np.asarray(z)
        return self.start * np.exp(self.scale * z) if self.logarithmic else self.start + self.scale * z

    def slope(self, z: float) -> float:
        """Derivative of the value by z."""
        return float(self.scale * (self.value(z) if self.logarithmic else 1.0))

    @property
    def bounds(self) -> tuple[float, float]:
        """Least and largest z."""
        if self.logarithmic:
            return -np.inf, np.inf
        return (self.low - self.start) / self.scale, (self.high - self.start) / self.scale


@dataclass(frozen=True, eq=False)
class Estimate:
    """Values of p parameters and how well n observations determine them.

    Attributes:
        parameters: The parameters.
        z: Where they are in their priors, shape (p,).
        sensitivities: A, shape (n, p).
        residuals: Predicted minus observed over φ σ, shape (n,).
        inflation: φ.
        evaluations: Of the model.
        converged: Whether the minimum was found.
    """

    parameters: Sequence[Parameter]
    z: FloatArray
    sensitivities: FloatArray
    residuals: FloatArray
    inflation: float
    evaluations: int
    converged: bool

    @cached_property
    def covariance(self) -> FloatArray:
        """Of z, shape (p, p)."""
        a = self.sensitivities
        return np.linalg.inv(a.T @ a + np.eye(a.shape[1]))

    @cached_property
    def singular_values(self) -> FloatArray:
        """Of A, shape (p,), largest first.

        Where one is below one, the prior says more of that combination of parameters than the observations.
        """
        found = np.linalg.svd(self.sensitivities, compute_uv=False)
        return np.append(found, np.zeros(len(self.z) - len(found)))

    @property
    def least_known(self) -> FloatArray:
        """The combination of z, of unit length, that the observations say least of, shape (p,)."""
        return np.asarray(np.linalg.svd(self.sensitivities)[2][-1])

    @property
    def freedom(self) -> float:
        """Degrees of freedom of the residuals."""
        return freedom_of(self.sensitivities)

    @property
    def condition(self) -> float:
        """Ratio of the largest to the smallest singular value."""
        largest, smallest = (float(self.singular_values[end]) for end in (0, -1))
        return largest / smallest if smallest else np.inf

    @property
    def values(self) -> FloatArray:
        """Values of the parameters, shape (p,)."""
        return np.array([float(u.value(z)) for u, z in zip(self.parameters, self.z, strict=True)])

    @property
    def deviations(self) -> FloatArray:
        """Standard deviations of the values, shape (p,); to first order where the prior is logarithmic."""
        slopes = [u.slope(z) for u, z in zip(self.parameters, self.z, strict=True)]
        return np.sqrt(np.diagonal(self.covariance)) * slopes

    @property
    def intervals(self) -> FloatArray:
        """Confidence intervals at `LEVEL`, shape (p, 2); by Student's t where φ was estimated."""
        upper = (1 + LEVEL) / 2
        times = norm.ppf(upper) if self.inflation == 1 else t.ppf(upper, self.freedom)
        ends = self.z[:, None] + times * np.sqrt(np.diagonal(self.covariance))[:, None] * [-1, 1]
        return np.array(
            [np.clip(u.value(e), u.low, u.high) for u, e in zip(self.parameters, ends, strict=True)]
        )

    @property
    def resolution(self) -> FloatArray:
        """Share of what is known of each parameter that the observations say, shape (p,): 0 to 1."""
        return np.asarray(1 - np.diagonal(self.covariance))

    @property
    def resolved(self) -> BoolArray:
        """Which parameters the observations determine, shape (p,)."""
        return np.asarray(self.resolution >= RESOLVED)

    def left_out(self, rows: IntArray) -> FloatArray:
        """Residuals, over φ σ, of observations if they had not been used, to first order: (I - H)^-1 r.

        H = A (A^T A + 1)^-1 A^T; exact for a linear model and the same φ (D. M. Allen, Technometrics 16
        (1974) 125-127).

        Args:
            rows: The observations that are left out together, shape (k,).
        """
        own = self.sensitivities[rows]
        return np.linalg.solve(np.eye(len(rows)) - own @ self.covariance @ own.T, self.residuals[rows])


def estimate(
    model: Callable[[FloatArray], Prediction],
    observed: FloatArray,
    deviations: FloatArray,
    parameters: Sequence[Parameter],
) -> Estimate:
    """Find the parameters by Gauss-Newton steps in a trust region.

    Args:
        model: Predictions and derivatives at parameters of shape (p,).
        observed: Shape (n,).
        deviations: Their standard deviations σ, shape (n,), all positive.
        parameters: The p parameters.
    """
    whitened = _Whitened(model, observed, deviations, parameters)
    count, one = len(parameters), np.eye(len(parameters))
    bounds = np.array([parameter.bounds for parameter in parameters]).T
    z = np.clip(np.zeros(count), *bounds)
    inflation = _inflation(whitened(z)[0], len(observed))
    for _ in range(ROUNDS):
        weight = 1 / inflation
        fit = least_squares(
            lambda z, weight=weight: np.concatenate([weight * whitened(z)[0], z]),
            z,
            lambda z, weight=weight: np.concatenate([weight * whitened(z)[1], one]),
            bounds=bounds,
            xtol=1e-6,
            ftol=1e-10,
            gtol=1e-8,
        )
        z = fit.x
        residuals, slopes = whitened(z)
        used, inflation = inflation, _inflation(residuals, freedom_of(weight * slopes))
        if settled := abs(inflation / used - 1) < SETTLED:
            break
    return Estimate(
        parameters=parameters,
        z=z,
        sensitivities=weight * slopes,
        residuals=weight * residuals,
        inflation=used,
        evaluations=whitened.evaluations,
        converged=bool(fit.success and settled),
    )


def freedom_of(sensitivities: FloatArray) -> float:
    """Observations less what the parameters take up of them, tr(A (A^T A + 1)^-1 A^T); at least one."""
    squares = np.linalg.svd(sensitivities, compute_uv=False) ** 2
    return max(len(sensitivities) - float((squares / (1 + squares)).sum()), 1.0)


class _Whitened:
    """Residuals over σ, shape (n,), and their derivatives by z, shape (n, p); the last ones are kept."""

    def __init__(
        self,
        model: Callable[[FloatArray], Prediction],
        observed: FloatArray,
        deviations: FloatArray,
        parameters: Sequence[Parameter],
    ) -> None:
        self._model, self._observed, self._deviations = model, observed, deviations
        self._parameters = parameters
        self._last: tuple[bytes, Prediction] | None = None
        self.evaluations = 0

    def __call__(self, z: FloatArray) -> Prediction:
        key = z.tobytes()
        if self._last is None or self._last[0] != key:
            pairs = list(zip(self._parameters, z, strict=True))
            predicted, slopes = self._model(np.array([float(u.value(place)) for u, place in pairs]))
            slopes = slopes * [u.slope(place) for u, place in pairs] / self._deviations[:, None]
            self._last = key, ((predicted - self._observed) / self._deviations, slopes)
            self.evaluations += 1
        return self._last[1]


def _inflation(residuals: FloatArray, freedom: float) -> float:
    """φ: one where noise explains the residuals."""
    misfit = float(residuals @ residuals)
    return 1.0 if misfit <= chi2.ppf(LEVEL, freedom) else float(np.sqrt(misfit / freedom))

"""Parameters from observations: weighted least squares with a prior, covariance and resolution.

With predictions y(θ), observations d of standard deviations σ, and a normal prior of the standardised values
z, of mean m and precision P, the estimate minimises

    Σ ((y(θ) - d) / φ σ)^2 + (z - m) . P (z - m)        z = (θ - θ0) / s   or   log(θ / θ0) / s

Where nothing was observed before, m is zero and P one: each θ has the mean θ0 and the standard deviation s,
of itself or of its logarithm.

φ is one where noise of the size σ explains the misfit. Where it does not, at a level of 95 % of χ^2, it is
the root of the misfit over its degrees of freedom, found together with θ, so that model error widens the
confidence intervals. With A = (dy/dz) / φ σ the covariance of z is (A^T A + P)^-1.

Observations may be gross errors: normally distributed with a large deviation, at given odds. Those are left
out, with whose leaving out the evidence grows the most, one after another: Laplace's approximation for the
linear model, -n log φ - (misfit + (z - m) . P (z - m)) / 2 - log det(A^T A + P) / 2 + log det P / 2 over the
n that are kept, and the odds.

Sources: A. Tarantola, Inverse Problem Theory, SIAM 2005, chapter 3 (estimate, covariance,
resolution); R. T. Birge, The calculation of errors by the method of least squares, Phys. Rev. 40 (1932)
207-227 (φ).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from math import log

import numpy as np
from scipy.optimize import least_squares
from scipy.special import chdtri, ndtri, stdtrit

from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray

LEVEL = 0.95
"""Level of confidence intervals, and of the test whether noise explains the misfit."""
MIN_RESOLUTION = 0.5
"""Minimum resolution for a parameter to count as determined by the data."""
MAX_ROUNDS, INFLATION_CHANGE = 8, 0.01
"""Least-squares fits at most, and the relative change of φ below which it has converged."""
MAX_STEPS, COST_CHANGE = 12, 1e-4
"""Steps of one fit at most, and the relative change of its cost below which it has converged.

At the minimum the cost is about half the number of observations: for twenty of them the change is a few
hundredths of a standard deviation. As much is added to the cost, so that exact observations are fitted no
further.
"""

Prediction = tuple[FloatArray, FloatArray]
"""Predictions, shape (n,), and their derivatives by the parameters, shape (n, p)."""


@dataclass(frozen=True)
class Parameter:
    """A parameter to be estimated."""

    name: str
    unit: str  # Empty for a pure number
    start: float  # Middle of the prior
    scale: float  # Standard deviation of the prior, of the value or, if `logarithmic`, of its logarithm
    low: float = -np.inf  # Bounds of the value
    high: float = np.inf
    logarithmic: bool = False  # Prior normal in the logarithm, for positive values known to a factor

    def value(self, z: float | FloatArray) -> FloatArray:
        """The value z standard deviations from the middle of the prior."""
        z = np.asarray(z)
        return self.start * np.exp(self.scale * z) if self.logarithmic else self.start + self.scale * z

    def derivative(self, z: float) -> float:
        """Derivative of the value by z."""
        return float(self.scale * (self.value(z) if self.logarithmic else 1.0))

    @property
    def middle(self) -> float:
        """Middle of the prior, of the value or, if `logarithmic`, of its logarithm."""
        return log(self.start) if self.logarithmic else self.start

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds of z."""
        ends = self.low, self.high
        if self.logarithmic:
            low, high = (log(end / self.start) if end > 0 else -np.inf for end in ends)
        else:
            low, high = (end - self.start for end in ends)
        return low / self.scale, high / self.scale


def values_of(parameters: Sequence[Parameter], z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values of p parameters and their derivatives by z, each of shape (p,)."""
    pairs = list(zip(parameters, z.tolist(), strict=True))
    return np.array([float(u.value(at)) for u, at in pairs]), np.array([u.derivative(at) for u, at in pairs])


@dataclass(frozen=True, eq=False)
class Prior:
    """What is known of standardised values z of p parameters: a normal distribution."""

    mean: FloatArray  # m, shape (p,)
    precision: FloatArray  # P, shape (p, p)

    @classmethod
    def independent(cls, count: int) -> "Prior":
        """That of p parameters that nothing but their own priors is known of."""
        return cls(np.zeros(count), np.eye(count))

    def apart(self, rows: BoolArray) -> "Prior":
        """The same, but some parameters, of mask (p,), have their own priors and go with no other."""
        both = np.multiply.outer(~rows, ~rows)
        return Prior(np.where(rows, 0.0, self.mean), np.where(both, self.precision, np.eye(len(rows))))

    @cached_property
    def root(self) -> FloatArray:
        """R with R^T R = P, shape (p, p)."""
        return np.asarray(np.linalg.cholesky(self.precision).T)

    @cached_property
    def spread(self) -> FloatArray:
        """R^-1: derivatives of z by p independent standard normal numbers."""
        return np.linalg.inv(self.root)

    def misfit(self, z: FloatArray) -> float:
        """(z - m) . P (z - m) at z, shape (p,)."""
        return float(((self.root @ (z - self.mean)) ** 2).sum())

    def log_volume(self, sensitivities: FloatArray) -> float:
        """Log det(A^T A + P) - log det P of sensitivities A, shape (n, p)."""
        own = sensitivities @ self.spread
        return float(np.linalg.slogdet(own.T @ own + np.eye(len(self.mean)))[1])

    def freedom(self, sensitivities: FloatArray) -> float:
        """Number of observations minus tr(A (A^T A + P)^-1 A^T) for A of shape (n, p); at least one."""
        squares = np.linalg.svd(sensitivities @ self.spread, compute_uv=False) ** 2
        return max(len(sensitivities) - float((squares / (1 + squares)).sum()), 1.0)


@dataclass(frozen=True, eq=False)
class GrossErrors:
    """Groups of observations that may be wrong together."""

    groups: IntArray  # Numbers of the observations of each, shape (g, k)
    log_odds: FloatArray  # Of its being wrong, and of the density then over that of no misfit, shape (g,)


NO_ERRORS = GrossErrors(np.zeros((0, 1), dtype=np.int64), np.zeros(0))


@dataclass(frozen=True, eq=False)
class Estimate:
    """Estimates of p parameters from n observations."""

    parameters: Sequence[Parameter]
    prior: Prior  # Of z
    z: FloatArray  # Standardised values, shape (p,)
    sensitivities: FloatArray  # A, shape (n, p)
    residuals: FloatArray  # Predicted minus observed over φ σ, shape (n,)
    kept: BoolArray  # Mask of the observations that are not left out as wrong, shape (n,)
    inflation: float  # φ
    evaluations: int  # Evaluations of the model
    converged: bool

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of z, shape (p, p)."""
        a = self.sensitivities[self.kept]
        return np.linalg.inv(a.T @ a + self.prior.precision)

    @property
    def explained(self) -> bool:
        """Whether noise explains the misfit."""
        freedom = self.prior.freedom(self.sensitivities[self.kept])
        return self.inflation == 1 and inflation_of(self.residuals[self.kept], freedom) == 1

    @property
    def values(self) -> FloatArray:
        """Values of the parameters, shape (p,)."""
        return values_of(self.parameters, self.z)[0]

    @property
    def slopes(self) -> FloatArray:
        """Derivatives of the values by z, shape (p,)."""
        return values_of(self.parameters, self.z)[1]

    @property
    def deviations(self) -> FloatArray:
        """Standard deviations of the values, shape (p,); to first order where the prior is logarithmic."""
        return np.sqrt(np.diagonal(self.covariance)) * self.slopes

    @property
    def quantile(self) -> float:
        """Half a confidence interval of z at `LEVEL` over its standard deviation."""
        return quantile_of(self.inflation, self.prior.freedom(self.sensitivities[self.kept]))

    @property
    def intervals(self) -> FloatArray:
        """Confidence intervals of the values at `LEVEL`, shape (p, 2)."""
        half = self.quantile * np.sqrt(np.diagonal(self.covariance))
        ends = zip(self.parameters, self.z[:, None] + half[:, None] * [-1, 1], strict=True)
        return np.array([np.clip(each.value(end), each.low, each.high) for each, end in ends])

    @property
    def resolution(self) -> FloatArray:
        """Resolution of each parameter, shape (p,): 0 where nothing was ever observed of it, up to 1."""
        return np.asarray(1 - np.diagonal(self.covariance))

    def residuals_without(self, rows: IntArray) -> FloatArray:
        """Residuals over φ σ of observations left out together, shape (k,): (I - H)^-1 r to first order.

        H is A (A^T A + P)^-1 A^T (D. M. Allen, Technometrics 16 (1974) 125-127).
        """
        own = self.sensitivities[rows] * self.kept[rows, None]
        return np.linalg.solve(np.eye(len(rows)) - own @ self.covariance @ own.T, self.residuals[rows])


def estimate(
    model: Callable[[FloatArray], Prediction | None],
    observed: FloatArray,
    deviations: FloatArray,
    parameters: Sequence[Parameter],
    start: FloatArray | None = None,
    errors: GrossErrors = NO_ERRORS,
    kept: BoolArray | None = None,
    *,
    prior: Prior | None = None,
    rounds: int = MAX_ROUNDS,
    steps: int = MAX_STEPS,
    cost_change: float = COST_CHANGE,
) -> Estimate:
    """Find the parameters by Gauss-Newton steps in a trust region.

    Args:
        model: Predictions and derivatives from parameter values, shape (p,); None where it has none, which
            a step of the search then avoids. It must have them at the start.
        observed: Shape (n,).
        deviations: Their standard deviations σ, shape (n,), all positive.
        parameters: The p parameters.
        start: Standardised values z from which the search starts, shape (p,); None: the prior's mean.
        errors: Observations that may be wrong.
        kept: Mask of those that are kept in the first round, shape (n,); all if None.
        prior: Of z; None: each parameter has its own.
        rounds: Fits at most, each with the last one's φ and without what was left out then.
        steps: Steps of one fit at most.
        cost_change: Relative change of the cost below which a fit has converged.
    """

    @cache  # least_squares asks for residuals and derivatives separately
    def evaluated(z: tuple[float, ...]) -> Prediction:
        """Residuals over σ, shape (n,), and their derivatives by z, shape (n, p)."""
        values, scales = values_of(parameters, np.array(z))
        if (found := model(values)) is None:
            return np.full(len(observed), np.inf), np.zeros((len(observed), count))
        predicted, derivatives = found
        return (predicted - observed) / deviations, derivatives * scales / deviations[:, None]

    def whitened(z: FloatArray) -> Prediction:
        return evaluated(tuple(z.tolist()))

    count = len(parameters)
    known = Prior.independent(count) if prior is None else prior
    expected, flat = np.sqrt(len(observed)), np.zeros(count)
    bounds = np.array([parameter.bounds for parameter in parameters]).T
    z = np.clip(known.mean if start is None else start, *bounds)
    if not np.isfinite(whitened(z)[0]).all():
        z = np.clip(known.mean, *bounds)
    inflation = 1.0  # a larger one from the start could leave the search where the priors are
    kept = np.ones(len(observed), dtype=bool) if kept is None else kept
    for _ in range(rounds):
        used = inflation
        fit = least_squares(
            lambda z, used=used, kept=kept: np.concatenate(
                [whitened(z)[0][kept] / used, known.root @ (z - known.mean), [expected]]
            ),
            z,
            lambda z, used=used, kept=kept: np.concatenate([whitened(z)[1][kept] / used, known.root, [flat]]),
            bounds=bounds,
            xtol=1e-6,
            ftol=cost_change,
            max_nfev=steps,
            gtol=1e-8,
        )
        z = fit.x
        residuals, derivatives = whitened(z)
        before, (inflation, kept) = kept, _linear_fit(residuals, derivatives, z, errors, known)
        settled = abs(inflation / used - 1) < INFLATION_CHANGE and (kept == before).all()
        if settled and fit.success:
            break
    return Estimate(
        parameters=parameters,
        prior=known,
        z=z,
        sensitivities=derivatives / used,
        residuals=residuals / used,
        kept=before,
        inflation=used,
        evaluations=evaluated.cache_info().misses,
        converged=bool(fit.success and settled),
    )


def _linear_fit(
    residuals: FloatArray, derivatives: FloatArray, z: FloatArray, errors: GrossErrors, prior: Prior
) -> tuple[float, BoolArray]:
    """φ, and the mask of the observations that are kept, for a linear model.

    It is about z, (p,), with the residuals over σ, shape (n,), and their derivatives there, (n, p).
    """
    kept, groups = np.ones(len(residuals), dtype=bool), list(range(len(errors.groups)))
    inflation, evidence = _linear_evidence(residuals, derivatives, z, prior)
    while inflation > 1 and groups:
        trials = np.tile(kept, (len(groups), 1))
        np.put_along_axis(trials, errors.groups[groups], values=False, axis=1)
        found = [_linear_evidence(residuals[trial], derivatives[trial], z, prior) for trial in trials]
        gains = np.array([each for _, each in found]) + errors.log_odds[groups] - evidence
        best = int(gains.argmax())
        if gains[best] <= 0:
            break
        kept, (inflation, evidence) = trials[best], found[best]
        groups.pop(best)
    return inflation, kept


def _linear_evidence(
    residuals: FloatArray, derivatives: FloatArray, z: FloatArray, prior: Prior
) -> tuple[float, float]:
    """φ of a linear model and the logarithm of its evidence, as `_linear_fit`."""
    inflation = 1.0
    for _ in range(MAX_ROUNDS):
        weighted = derivatives / inflation**2
        matrix = weighted.T @ derivatives + prior.precision
        step = np.linalg.solve(matrix, -weighted.T @ residuals - prior.precision @ (z - prior.mean))
        used = inflation
        inflation = inflation_of(residuals + derivatives @ step, prior.freedom(derivatives / inflation))
        if abs(inflation / used - 1) < 0.1 * INFLATION_CHANGE:
            break
    left = residuals + derivatives @ step
    misfit = float(left @ left) / inflation**2 + prior.misfit(z + step)
    volume = prior.log_volume(derivatives / used)
    return inflation, -len(left) * log(inflation) - 0.5 * (misfit + volume)


def quantile_of(inflation: float, freedom: float) -> float:
    """Half an interval of `LEVEL` over the standard deviation; Student's where φ was estimated."""
    upper = (1 + LEVEL) / 2
    return float(ndtri(upper) if inflation == 1 else stdtrit(freedom, upper))


def inflation_of(residuals: FloatArray, freedom: float) -> float:
    """φ: one where noise explains the residuals."""
    misfit = float(residuals @ residuals)
    return 1.0 if misfit <= chdtri(freedom, 1 - LEVEL) else float(np.sqrt(misfit / freedom))

"""Parameters from observations: weighted least squares with a prior, and what the observations say of each.

With predictions y(θ), observations d of standard deviations σ, and a Gaussian prior with the mean θ0 and the
standard deviations s, the estimate minimises

    Σ ((y(θ) - d) / φ σ)^2 + Σ ((θ - θ0) / s)^2

over the bounds of the parameters. φ is one where noise of the size σ explains the misfit. Where it does not,
at a level of 95 % of χ^2, it is the root of the misfit over its degrees of freedom, found together with θ: a
model that is wrong by φ σ must not be believed to σ. With A = (dy/dθ) s / φ σ, row by row and column by
column, the covariance of the estimate is s (A^T A + 1)^-1 s.

Sources: A. Tarantola, Inverse Problem Theory, SIAM 2005, section 3.2 (estimate and covariance), section 3.3
(resolution); R. T. Birge, The calculation of errors by the method of least squares, Phys. Rev. 40 (1932)
207-227 (φ).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import chi2, norm, t

from geometry.arrays import BoolArray, FloatArray

LEVEL = 0.95
"""Of confidence intervals, and of the test whether noise explains the misfit."""

RESOLVED = 0.5
"""Least share of what is known of a parameter that must come from the observations."""

ROUNDS = 20
"""Estimates at most until φ settles."""

Prediction = tuple[FloatArray, FloatArray]
"""Predictions, shape (n,), and their derivatives by the parameters, shape (n, p)."""


@dataclass(frozen=True)
class Unknown:
    """A parameter that is to be found.

    Attributes:
        name: What it is called.
        unit: Of its value; empty for a pure number.
        start: Mean of its prior: what it is taken for before anything is observed.
        scale: Standard deviation of its prior: how far it may be off.
        low: Least value that it can have.
        high: Largest value.
    """

    name: str
    unit: str
    start: float
    scale: float
    low: float = -np.inf
    high: float = np.inf


@dataclass(frozen=True, eq=False)
class Estimate:
    """Values of p parameters and how well n observations determine them.

    Attributes:
        unknowns: The parameters.
        values: Shape (p,).
        covariance: Shape (p, p).
        singular_values: Of A, shape (p,), largest first: below one, the prior says more of a combination
            than the observations do.
        combinations: The combinations, shape (p, p): row i has unit length in parameters over their scales.
        residuals: Predicted minus observed over σ, shape (n,).
        inflation: φ.
        freedom: Degrees of freedom of the residuals: n less the number of resolved combinations.
        evaluations: Of the model.
        converged: Whether the minimum was found.
    """

    unknowns: Sequence[Unknown]
    values: FloatArray
    covariance: FloatArray
    singular_values: FloatArray
    combinations: FloatArray
    residuals: FloatArray
    inflation: float
    freedom: float
    evaluations: int
    converged: bool

    @property
    def deviations(self) -> FloatArray:
        """Standard deviations of the parameters, shape (p,)."""
        return np.sqrt(np.diagonal(self.covariance))

    @property
    def intervals(self) -> FloatArray:
        """Confidence intervals at `LEVEL`, shape (p, 2); Student's t where φ was estimated."""
        upper = (1 + LEVEL) / 2
        times = norm.ppf(upper) if self.inflation == 1 else t.ppf(upper, self.freedom)
        ends = self.values[:, None] + times * self.deviations[:, None] * [-1, 1]
        return np.clip(ends, *np.array([[[u.low], [u.high]] for u in self.unknowns]).swapaxes(0, 1))

    @property
    def resolution(self) -> FloatArray:
        """Share of what is known of each parameter that the observations say, shape (p,): 0 to 1."""
        return 1 - np.diagonal(self.covariance) / np.array([u.scale for u in self.unknowns]) ** 2

    @property
    def resolved(self) -> BoolArray:
        """Which parameters the observations determine, shape (p,)."""
        return self.resolution >= RESOLVED

    @property
    def condition(self) -> float:
        """Ratio of the largest to the smallest singular value."""
        return float(self.singular_values[0] / max(self.singular_values[-1], np.finfo(float).tiny))


def estimate(
    model: Callable[[FloatArray], Prediction],
    observed: FloatArray,
    deviations: FloatArray,
    unknowns: Sequence[Unknown],
) -> Estimate:
    """Find the parameters by Gauss-Newton steps in a trust region.

    Args:
        model: Predictions and derivatives at parameters of shape (p,).
        observed: Shape (n,).
        deviations: Their standard deviations σ, shape (n,), all positive.
        unknowns: The p parameters.
    """
    start, scale = (np.array([getattr(u, name) for u in unknowns]) for name in ("start", "scale"))
    bounds = [(np.array([getattr(u, name) for u in unknowns]) - start) / scale for name in ("low", "high")]
    one, count = np.eye(len(unknowns)), len(observed)
    known: dict[bytes, Prediction] = {}

    def whitened(z: FloatArray) -> Prediction:
        if z.tobytes() not in known:
            values, slopes = model(start + scale * z)
            known.clear()
            known[z.tobytes()] = (values - observed) / deviations, slopes * scale / deviations[:, None]
            calls.append(1)
        return known[z.tobytes()]

    calls: list[int] = []
    z, inflation = np.clip(np.zeros(len(unknowns)), *bounds), 1.0
    for _ in range(ROUNDS):
        weight = 1 / inflation
        fit = least_squares(
            lambda z, weight=weight: np.concatenate([weight * whitened(z)[0], z]),
            z,
            lambda z, weight=weight: np.concatenate([weight * whitened(z)[1], one]),
            bounds=bounds,
            method="dogbox",
            xtol=1e-8,
            ftol=1e-10,
            gtol=1e-8,
        )
        z = fit.x
        residuals, slopes = whitened(z)
        _, singular, combinations = np.linalg.svd(slopes * weight, full_matrices=len(unknowns) > count)
        singular = np.append(singular, np.zeros(len(unknowns) - len(singular)))
        freedom = max(count - float((singular**2 / (1 + singular**2)).sum()), 1.0)
        before, inflation = inflation, _inflation(residuals, freedom)
        if abs(inflation / before - 1) < 1e-3:
            break
    spread = scale[:, None] * combinations.T / np.sqrt(1 + singular**2)
    return Estimate(
        unknowns=unknowns,
        values=start + scale * z,
        covariance=spread @ spread.T,
        singular_values=singular,
        combinations=combinations,
        residuals=residuals,
        inflation=before,
        freedom=freedom,
        evaluations=len(calls),
        converged=bool(fit.success) and abs(inflation / before - 1) < 1e-3,
    )


def _inflation(residuals: FloatArray, freedom: float) -> float:
    """φ: one where noise explains the residuals."""
    misfit = float(residuals @ residuals)
    return 1.0 if misfit <= chi2.ppf(LEVEL, freedom) else float(np.sqrt(misfit / freedom))

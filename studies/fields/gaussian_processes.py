"""Vectors that are predicted by modes: a Gaussian process for the coefficient of each, evaluated together.

The kernel is Matérn's of order 5/2, with one length for every input: where a rib begins, what a load does has
a kink. Source: C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press 2006:
eq. 4.17.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.studies.emulator.gaussian_process import likeliest
from pinnray.studies.fields.reduction import Modes

WATCHED = 12
"""Leading modes whose standard deviations are predicted: they cost more than all other numbers."""

LANDMARKS = 100
"""Samples at most from which the standard deviation at a point is taken."""


@dataclass(frozen=True, eq=False)
class Block:
    """Modes of vectors, and a process for each of their r coefficients.

    Attributes:
        modes: Of the vectors.
        inputs: Of the samples, shape (n, d).
        rates: Inverse squared lengths of every process, shape (r, d).
        weights: Shape (n, r).
        numbers: Mean, standard deviation and noise's variance over it of every process, shape (3, r).
        factors: Inverse Cholesky factors of the covariance of the first m samples, of the w leading modes,
            shape (w, m, m).
        left_out: Errors of the samples' coefficients, each predicted from all others, shape (n, r).
    """

    modes: Modes
    inputs: FloatArray
    rates: FloatArray
    weights: FloatArray
    numbers: FloatArray
    factors: FloatArray
    left_out: FloatArray

    @classmethod
    def fitted(cls, inputs: FloatArray, modes: Modes, coefficients: FloatArray) -> Self:
        """The block of samples whose coefficients (n, r) are known."""
        from sklearn.gaussian_process.kernels import Matern

        means, spreads = coefficients.mean(axis=0), coefficients.std(axis=0)
        spreads[spreads == 0] = 1.0
        start = Matern(np.full(inputs.shape[1], 2.0), (0.05, 1e3), nu=2.5)
        count = min(len(inputs) // 2, LANDMARKS)
        fits = [
            likeliest(inputs, each, start, landmarks=count) for each in ((coefficients - means) / spreads).T
        ]
        lengths, noises, weights, factors, left_out = (np.array(each) for each in zip(*fits, strict=True))
        return cls(
            modes,
            inputs,
            1 / lengths**2,
            spreads * weights.T,
            np.array([means, spreads, noises]),
            factors[:WATCHED],
            spreads * left_out.T,
        )

    def vector(self, inputs: FloatArray) -> FloatArray:
        """The vector at inputs (d,)."""
        covariance = matern((self.inputs - inputs) ** 2 @ self.rates.T)
        return self.modes.combined(self.numbers[0] + np.einsum("nr,nr->r", covariance, self.weights))

    @property
    def landmarks(self) -> int:
        """Number of the first samples, from which standard deviations are taken."""
        return self.factors.shape[1]

    def deviations(self, inputs: FloatArray) -> FloatArray:
        """Standard deviations of the leading coefficients at inputs (d,), shape (w,)."""
        squares = (self.inputs[: self.landmarks] - inputs) ** 2
        covariance = matern(squares @ self.rates[: len(self.factors)].T)
        known = ((self.factors @ covariance.T[..., None])[..., 0] ** 2).sum(axis=1)
        _, spread, noise = self.numbers[:, : len(known)]
        return np.asarray(spread * np.sqrt(np.maximum(1 - known, 0.0) + noise))


def matern(squares: FloatArray) -> FloatArray:
    """The kernel of squared distances over the lengths."""
    away = np.sqrt(5 * squares)
    return np.asarray((1 + away + away**2 / 3) * np.exp(-away))

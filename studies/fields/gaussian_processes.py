"""Vectors that are predicted by modes: a Gaussian process for the coefficient of each, evaluated together.

The kernel is Matérn's of order 5/2, with one length for every input: where a rib begins, what a load does has
a kink. Source: C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press 2006:
eq. 4.17, algorithm 2.1, eq. 5.12 (leave-one-out).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.studies.emulator.gaussian_process import conditioned, left_out, likeliest
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
    """

    modes: Modes
    inputs: FloatArray
    rates: FloatArray
    weights: FloatArray
    numbers: FloatArray
    factors: FloatArray

    @classmethod
    def fitted(cls, inputs: FloatArray, modes: Modes, coefficients: FloatArray) -> Self:
        """The block of samples whose coefficients (n, r) are known."""
        from sklearn.gaussian_process.kernels import Matern

        count = min(len(inputs) // 2, LANDMARKS)
        squares = (inputs[:, None] - inputs) ** 2
        rates, weights, numbers = [], [], []
        factors: list[FloatArray] = []
        start = Matern(np.full(inputs.shape[1], 2.0), (0.05, 1e3), nu=2.5)
        for column in coefficients.T:
            mean, spread = float(column.mean()), float(column.std()) or 1.0
            lengths, noise = likeliest(inputs, (column - mean) / spread, start)
            rate = 1 / lengths**2
            factor, weight = conditioned(matern(squares @ rate) + noise * np.eye(len(inputs)), column - mean)
            rates.append(rate)
            weights.append(weight)
            numbers.append((mean, spread, noise))
            if len(factors) < WATCHED:
                factors.append(np.linalg.inv(factor[:count, :count]))
        return cls(
            modes, inputs, np.array(rates), np.array(weights).T, np.array(numbers).T, np.array(factors)
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

    @cached_property
    def left_out(self) -> FloatArray:
        """Errors of the samples' coefficients, each predicted from all others, shape (n, r)."""
        squares = (self.inputs[:, None] - self.inputs) ** 2
        errors = np.empty_like(self.weights)
        for mode, rates in enumerate(self.rates):
            covariance = matern(squares @ rates) + self.numbers[2, mode] * np.eye(len(squares))
            factor, _ = conditioned(covariance, self.weights[:, mode])
            errors[:, mode] = left_out(factor, self.weights[:, mode])
        return errors


def matern(squares: FloatArray) -> FloatArray:
    """The kernel of squared distances over the lengths."""
    away = np.sqrt(5 * squares)
    return np.asarray((1 + away + away**2 / 3) * np.exp(-away))

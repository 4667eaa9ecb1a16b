"""Gaussian process of one quantity: lengths by scikit-learn on a part of the samples, weights from all.

The intervals come from the residuals of the samples, each predicted from all others in closed form, in
multiples of the process's own standard deviation from a few of the samples. Where there are few samples, many
lengths fit them so well that such residuals are too small: there a process that is fitted without a sample,
lengths and all, predicts it, and the interval is equally wide everywhere.

Source: C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press 2006: algorithm
2.1, eq. 5.12 (leave-one-out).
"""

import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from scipy.linalg import cholesky, lapack, solve_triangular

from pinnray.runtime.arrays import FloatArray

LEARNERS = 400
"""Samples from which the lengths are learnt: a step costs their cube."""

LANDMARKS = 300
"""Samples from which the standard deviation at a point is taken."""

FEW = 200
"""Samples below which they are left out in `FOLDS` parts, with a fit for each part."""

FOLDS = 10

LEVEL = 0.95
"""Probability of the intervals."""


@dataclass(frozen=True, eq=False)
class GaussianProcess:
    """A fitted process with the squared-exponential kernel, one length for every input.

    Attributes:
        inputs: Of the samples, divided by the lengths, shape (n, d).
        weights: Of the samples, shape (n,), in the quantity's unit.
        factor: Inverse Cholesky factor of the landmarks' covariance (the first samples), shape (m, m).
        lengths: Shape (d,).
        numbers: Mean and standard deviation of the quantity, the noise's variance, and the half width of the
            interval in standard deviations, shape (4,).
    """

    inputs: FloatArray
    weights: FloatArray
    factor: FloatArray
    lengths: FloatArray
    numbers: FloatArray

    @classmethod
    def fitted(cls, inputs: FloatArray, values: FloatArray, *, quick: bool = False) -> Self:
        """The process of samples in random order, inputs of shape (n, d) and values of shape (n,).

        Args:
            inputs: Of the samples.
            values: Of the quantity.
            quick: Whether the intervals of few samples may be too narrow.
        """
        from sklearn.gaussian_process.kernels import RBF

        mean, spread = float(values.mean()), float(values.std()) or 1.0
        scaled = (values - mean) / spread
        start = RBF(np.full(inputs.shape[1], 3.0), (0.05, 1e3))
        lengths, noise = likeliest(inputs[:LEARNERS], scaled[:LEARNERS], start)
        near = inputs / lengths
        covariance = _kernel(near, near, (near**2).sum(axis=1))
        covariance[np.diag_indices_from(covariance)] += noise
        factor, weights = conditioned(covariance, scaled)
        count = min(LANDMARKS, len(inputs) // 2)
        inner = np.linalg.inv(factor[:count, :count])
        if folded := len(inputs) < FEW and not quick:
            inner = np.zeros((1, 1))  # the deviation of a few samples is no guide to where they err more
        made = cls(near, weights * spread, inner, lengths, np.array([mean, spread, noise, 1.0]))
        if folded:
            ratios = cls._left_out(inputs, values) / made.deviation(inputs)
        else:
            residuals = np.abs(left_out(factor, weights))
            ratios = residuals[count:] * spread / made.deviation(inputs[count:])
        ratios = np.sort(ratios)
        rank = min(int(np.ceil(LEVEL * (len(ratios) + 1))), len(ratios)) - 1
        return cls(near, made.weights, inner, lengths, np.array([mean, spread, noise, float(ratios[rank])]))

    @classmethod
    def _left_out(cls, inputs: FloatArray, values: FloatArray) -> FloatArray:
        """Residuals of samples, each from a process that is fitted without it, shape (n,)."""
        residuals = np.empty(len(values))
        part = np.arange(len(values)) % FOLDS
        for number in range(FOLDS):
            out = part == number
            process = cls.fitted(inputs[~out], values[~out], quick=True)
            residuals[out] = np.abs(values[out] - process.predict(inputs[out])[0])
        return residuals

    @cached_property
    def squares(self) -> FloatArray:
        """Squared lengths of the inputs, shape (n,)."""
        return np.asarray((self.inputs**2).sum(axis=1))

    def predict(self, inputs: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Prediction and half width of its interval at inputs of shape (k, d), shape (k,) each."""
        covariance = _kernel(inputs / self.lengths, self.inputs, self.squares)
        width = self.numbers[3] * self._deviation(covariance[:, : len(self.factor)])
        return self.numbers[0] + covariance @ self.weights, width

    def deviation(self, inputs: FloatArray) -> FloatArray:
        """Standard deviation of the quantity at inputs of shape (k, d) from the landmarks, shape (k,)."""
        count = len(self.factor)
        return self._deviation(_kernel(inputs / self.lengths, self.inputs[:count], self.squares[:count]))

    def _deviation(self, covariance: FloatArray) -> FloatArray:
        known = ((covariance @ self.factor.T) ** 2).sum(axis=1)
        return np.asarray(self.numbers[1] * np.sqrt(np.maximum(1 - known, 0) + self.numbers[2]))


def likeliest(inputs: FloatArray, values: FloatArray, kernel: Any) -> tuple[FloatArray, float]:
    """Length of every input, and the noise's variance over the signal's, of the largest likelihood.

    Args:
        inputs: Shape (n, d).
        values: Of standard deviation one, shape (n,).
        kernel: Of scikit-learn, with the lengths from which the search starts.
    """
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, WhiteKernel

    whole = ConstantKernel(10.0, (1e-2, 1e5)) * kernel + WhiteKernel(1e-4, (1e-10, 10.0))
    process = GaussianProcessRegressor(whole)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # that a length is at its bound
        process.fit(inputs, values)
    signal, *lengths, noise = np.exp(process.kernel_.theta)
    return np.array(lengths), float(noise / signal)


def conditioned(covariance: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Cholesky factor of a covariance, which is overwritten, and the weights of the values."""
    factor = cholesky(covariance, lower=True, overwrite_a=True, check_finite=False)
    half = solve_triangular(factor, values, lower=True, check_finite=False)
    return factor, solve_triangular(factor, half, lower=True, trans=1, check_finite=False)


def left_out(factor: FloatArray, weights: FloatArray) -> FloatArray:
    """Errors of the values, each predicted from all others; the factor is overwritten."""
    inverse, _ = lapack.dpotri(factor, lower=1, overwrite_c=1)
    return np.asarray(weights / np.diag(inverse))


def _kernel(first: FloatArray, second: FloatArray, squares: FloatArray) -> FloatArray:
    """Squared-exponential kernel of inputs (k, d) and (n, d) over the lengths, shape (k, n)."""
    exponent = first @ second.T
    exponent -= 0.5 * (first**2).sum(axis=1)[:, None]
    exponent -= 0.5 * squares
    np.minimum(exponent, 0, out=exponent)
    return np.asarray(np.exp(exponent, out=exponent))

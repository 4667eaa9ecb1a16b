"""Gaussian process of one quantity by scikit-learn: lengths from a part of the samples, weights from all.

The intervals come from the residuals of the samples, each predicted from all others in closed form, in
multiples of the process's own standard deviation from a few of the samples. Where there are few samples, many
lengths fit them so well that such residuals are too small: there a process that is fitted without a sample,
lengths and all, predicts it, and the interval is equally wide everywhere.

Source: C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press 2006: algorithm
2.1, eq. 5.12 (leave-one-out).
"""

import warnings
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np
from scipy.linalg import lapack
from scipy.spatial.distance import cdist

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


class Fit(NamedTuple):
    """A process of mean zero and variance one that is conditioned on n samples.

    Attributes:
        lengths: Of the d inputs, shape (d,).
        noise: Its variance.
        weights: Of the samples, shape (n,).
        factor: Inverse Cholesky factor of the covariance of the first samples, the landmarks, shape (m, m).
        left_out: Errors of the samples, each predicted from all others, shape (n,).
    """

    lengths: FloatArray
    noise: float
    weights: FloatArray
    factor: FloatArray
    left_out: FloatArray


@dataclass(frozen=True, eq=False)
class GaussianProcess:
    """A fitted process with the squared-exponential kernel, one length for every input.

    Attributes:
        inputs: Of the samples, divided by the lengths, shape (n, d).
        fit: Of the quantity less its mean over its standard deviation.
        mean: Of the quantity.
        spread: Its standard deviation.
        half: Half width of the interval in standard deviations.
    """

    inputs: FloatArray
    fit: Fit
    mean: float
    spread: float
    half: float = 1.0

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
        start, count = RBF(np.full(inputs.shape[1], 3.0), (0.05, 1e3)), min(LANDMARKS, len(inputs) // 2)
        fit = likeliest(inputs, (values - mean) / spread, start, landmarks=count, learners=LEARNERS)
        if len(inputs) < FEW and not quick:
            fit, count = fit._replace(factor=np.zeros((1, 1))), 0  # few do not tell where they err more
            residuals, part = np.empty(len(values)), np.arange(len(values)) % FOLDS
            for out in (part == number for number in range(FOLDS)):
                process = cls.fitted(inputs[~out], values[~out], quick=True)
                residuals[out] = values[out] - process.predict(inputs[out])[0]
        else:
            residuals = spread * fit.left_out
        made = cls(inputs / fit.lengths, fit, mean, spread)
        ratios = np.abs(residuals[count:]) / made.predict(inputs[count:])[1]
        return replace(made, half=float(calibrated(ratios)))

    def predict(self, inputs: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Prediction and half width of its interval at inputs of shape (k, d), shape (k,) each."""
        _, noise, weights, factor, _ = self.fit
        covariance = np.exp(-0.5 * cdist(inputs / self.fit.lengths, self.inputs, "sqeuclidean"))
        known = ((covariance[:, : len(factor)] @ factor.T) ** 2).sum(axis=1)
        deviation = self.spread * np.sqrt(np.maximum(1 - known, 0) + noise)
        return self.mean + self.spread * (covariance @ weights), self.half * deviation


def likeliest(
    inputs: FloatArray, values: FloatArray, kernel: Any, *, landmarks: int, learners: int | None = None
) -> Fit:
    """The process of the largest likelihood.

    Args:
        inputs: Of the samples, shape (n, d).
        values: Of standard deviation one, shape (n,).
        kernel: Of scikit-learn, with the lengths from which the search starts.
        landmarks: How many of the first samples are landmarks.
        learners: How many of the first samples the lengths and the noise are learnt from; None means all.
    """
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, WhiteKernel

    whole = ConstantKernel(10.0, (1e-2, 1e5)) * kernel + WhiteKernel(1e-4, (1e-10, 10.0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # that a length is at its bound
        process = GaussianProcessRegressor(whole).fit(inputs[:learners], values[:learners])
    if len(process.alpha_) < len(inputs):
        process = GaussianProcessRegressor(process.kernel_, optimizer=None).fit(inputs, values)
    signal, *lengths, noise = np.exp(process.kernel_.theta)
    inverse, _ = lapack.dpotri(process.L_, lower=1)
    factor = np.sqrt(signal) * np.linalg.inv(process.L_[:landmarks, :landmarks])
    left_out = process.alpha_ / np.diag(inverse)
    return Fit(np.array(lengths), noise / signal, signal * process.alpha_, factor, left_out)


def calibrated(ratios: FloatArray) -> FloatArray:
    """The factor of intervals that hold, from ratios of errors to those expected, (n, ...): shape (...)."""
    rank = min(int(np.ceil(LEVEL * (len(ratios) + 1))), len(ratios)) - 1
    return np.asarray(np.sort(ratios, axis=0)[rank])

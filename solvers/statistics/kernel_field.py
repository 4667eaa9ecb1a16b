"""Displacement fields as sums of Matérn kernels, the posterior means of Gaussian processes; markers left out.

The kernel k = (1 + r + r²/3) exp(-r), r = √5 |x - x'| / length, is of processes with two derivatives.

Source: C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press 2006, equations
4.9, 4.16 and 4.17.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.distance import cdist

from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.assimilation.misfit import leave_one_out_displacements
from pinnray.solvers.solution import Solution

MarkerPrediction = tuple[FloatArray, FloatArray]
"""Mean and standard deviation of an observation, each of shape (2,), mm."""


@dataclass(frozen=True, eq=False)
class KernelField:
    """Σ_i c_i k(|x - x_i|), with coefficients and a length for each component."""

    centres: FloatArray  # x_i, shape (m, 2), mm
    coefficients: FloatArray  # c_i, shape (m, 2), mm
    lengths: FloatArray  # Lengths of k for u and v, shape (2,), mm

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement, shape (n, 2), mm."""
        kernels = [correlation(location.points, self.centres, length) for length in self.lengths]
        return np.asarray((np.stack(kernels, axis=-1) * self.coefficients).sum(axis=1))

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 2, 2)."""
        derivatives = [_derivative_factor(location.points, self.centres, length) for length in self.lengths]
        weighted = np.stack(derivatives, axis=-1) * self.coefficients
        offset = self.centres - location.points[:, None]
        return np.asarray(np.einsum("nmc,nmx->ncx", weighted, offset))


def correlation(points: FloatArray, others: FloatArray, length: float) -> FloatArray:
    """The kernel between points (n, 2) and others (m, 2), mm: shape (n, m); 1 at distance zero."""
    distance = _distance(points, others, length)
    return np.asarray((1 + distance + distance**2 / 3) * np.exp(-distance))


def derivative_by_log_length(points: FloatArray, others: FloatArray, length: float) -> FloatArray:
    """Derivative of `correlation` by the length's logarithm, shape (n, m): -r dk/dr at a distance r."""
    squares = cdist(points, others, "sqeuclidean")
    return np.asarray(squares * _derivative_factor(points, others, length))


def _derivative_factor(points: FloatArray, others: FloatArray, length: float) -> FloatArray:
    """Factor f in the gradient of k at the points, ∇k = f (others - points), shape (n, m), 1/mm²."""
    distance = _distance(points, others, length)
    return np.asarray(5 / 3 * (1 + distance) * np.exp(-distance) / length**2)


def _distance(points: FloatArray, others: FloatArray, length: float) -> FloatArray:
    """√5 |x - x'| / length: shape (n, m)."""
    return np.asarray(cdist(points, others) * np.sqrt(5.0) / length)


def with_markers_left_out(
    solution: Solution, observed: FloatArray, without: Callable[[int], MarkerPrediction], started: float
) -> Solution:
    """A solution with every marker as predicted without it, and the share within two standard deviations.

    Args:
        solution: Conditioned on all markers that were seen.
        observed: Their displacements, shape (m, 2), mm.
        without: Predicts a marker by the others.
        started: When the solver began, by `time.perf_counter`, s.
    """
    predictions = [without(marker) for marker in range(len(observed))]
    means, spreads = (np.array(values) for values in zip(*predictions, strict=True))
    residuals = observed - means
    within = float((np.abs(residuals) < 2 * spreads).mean())
    seconds = time.perf_counter() - started
    stats = {**solution.stats, "seconds": seconds, "left_out_within_2sd": within}
    left_out = leave_one_out_displacements(solution.problem, residuals)
    return replace(solution, stats=stats, left_out=left_out)

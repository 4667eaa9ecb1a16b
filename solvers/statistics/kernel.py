"""Matérn's kernel of processes with two derivatives: k = (1 + r + r²/3) exp(-r), r = √5 |x - x'| / length.

Source: C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press 2006, equations
4.9, 4.16 and 4.17.
"""

import numpy as np
from scipy.spatial.distance import cdist

from pinnray.runtime.arrays import FloatArray


def correlation(points: FloatArray, others: FloatArray, length: float) -> FloatArray:
    """The kernel between points (n, 2) and others (m, 2), mm: shape (n, m); 1 at distance zero."""
    distance = _distance(points, others, length)
    return np.asarray((1 + distance + distance**2 / 3) * np.exp(-distance))


def derivative_by_log_length(points: FloatArray, others: FloatArray, length: float) -> FloatArray:
    """Derivative of `correlation` by the length's logarithm, shape (n, m): -r dk/dr at a distance r."""
    squares = cdist(points, others, "sqeuclidean")
    return np.asarray(squares * gradient_factor(points, others, length))


def gradient_factor(points: FloatArray, others: FloatArray, length: float) -> FloatArray:
    """Factor f in the gradient of k at the points, ∇k = f (others - points), shape (n, m), 1/mm²."""
    distance = _distance(points, others, length)
    return np.asarray(5 / 3 * (1 + distance) * np.exp(-distance) / length**2)


def _distance(points: FloatArray, others: FloatArray, length: float) -> FloatArray:
    """√5 |x - x'| / length: shape (n, m)."""
    return np.asarray(cdist(points, others) * np.sqrt(5.0) / length)

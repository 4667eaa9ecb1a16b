"""Matérn's kernel of processes with two derivatives, by Bessel functions."""

import numpy as np
from scipy.special import gamma, kv

from pinnray.runtime.arrays import FloatArray


def matern(first: FloatArray, second: FloatArray, length: float) -> FloatArray:
    """Equation 4.14 of Rasmussen and Williams; points (n, 2) and (m, 2): shape (n, m)."""
    distance = np.sqrt(((first[:, None] - second) ** 2).sum(axis=2))
    smoothness = 2.5
    x = np.maximum(np.sqrt(2 * smoothness) * distance / length, 1e-8)
    return np.asarray(2 ** (1 - smoothness) / gamma(smoothness) * x**smoothness * kv(smoothness, x))

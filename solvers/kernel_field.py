"""Smooth displacement fields of the squared exponential kernel, as Gaussian processes make them."""

from dataclasses import dataclass

import numpy as np

from geometry.arrays import FloatArray
from geometry.locate import Location


@dataclass(frozen=True, eq=False)
class KernelField:
    """Σ_i c_i exp(-|x - x_i|² / (2 l²)), each component with coefficients and a length of its own.

    Attributes:
        centres: x_i, shape (m, 2), mm.
        coefficients: c_i, shape (m, 2), mm.
        lengths: l for u and v, shape (2,), mm.
    """

    centres: FloatArray
    coefficients: FloatArray
    lengths: FloatArray

    def displacement(self, location: Location) -> FloatArray:
        """Displacement, shape (n, 2), mm."""
        return np.asarray((self._kernels(location.points) * self.coefficients).sum(axis=1))

    def gradient(self, location: Location) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 2, 2)."""
        weighted = self._kernels(location.points) * self.coefficients / self.lengths**2
        offset = self.centres - location.points[:, None]
        return np.asarray(np.einsum("nmc,nmx->ncx", weighted, offset))

    def _kernels(self, points: FloatArray) -> FloatArray:
        """Shape (n, m, 2)."""
        return np.stack([squared_exponential(points, self.centres, length) for length in self.lengths], -1)


def squared_exponential(points: FloatArray, others: FloatArray, length: float) -> FloatArray:
    """exp(-|x - x'|² / (2 l²)) between points (n, 2) and others (m, 2), mm: shape (n, m)."""
    squares = ((points[:, None] - others) ** 2).sum(axis=2)
    return np.asarray(np.exp(-squares / (2 * length**2)))

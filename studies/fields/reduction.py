"""Few modes in place of many displacement fields: proper orthogonal decomposition.

Displacement gradients decide what counts, as they do in the elastic energy: so that stress, too, is kept.
Source: L. Sirovich, Quarterly of Applied Mathematics 45 (1987) 561-571 (the method of snapshots).
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.linalg import eigh

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.lagrange import LagrangeSpace


@dataclass(frozen=True, eq=False)
class Modes:
    """Linear combinations of mode vectors about a mean.

    Attributes:
        mean: Shape (m,).
        vectors: Shape (r, m).
    """

    mean: FloatArray
    vectors: FloatArray

    @classmethod
    def of(cls, rows: FloatArray, least: float) -> tuple[Self, FloatArray]:
        """Modes of rows (n, m), the largest first, and the coefficients of every row, shape (n, r).

        Modes are left out of which all together have a share `least` of the rows' squares about their mean.
        """
        mean = rows.mean(axis=0)
        return cls._of(mean, rows - mean, (rows - mean) @ (rows - mean).T, least)

    @classmethod
    def of_fields(cls, nodal: FloatArray, space: LagrangeSpace, least: float) -> tuple[Self, FloatArray]:
        """Modes of displacements (n, N, 2) of the nodes of elements, about zero, by their gradients."""
        count = len(nodal)
        middles = space.mesh.at_centroids()
        root = np.sqrt(space.mesh.areas)
        flat = nodal.reshape(count, -1)
        gram = np.zeros((count, count))
        for slope in space.shape_gradients(middles):
            for axis in range(2):
                values = (slope @ nodal[:, :, axis].T) * root[:, None]
                gram += values.T @ values
        return cls._of(np.zeros(flat.shape[1]), flat, gram, least)

    @classmethod
    def _of(
        cls, mean: FloatArray, rows: FloatArray, gram: FloatArray, least: float
    ) -> tuple[Self, FloatArray]:
        values, vectors = eigh(gram)
        values, vectors = values[::-1].clip(0), vectors[:, ::-1]
        left = values[::-1].cumsum()[::-1]  # from each mode on
        kept = (left > least * left[0]) & (values > 1e-12 * values[0])
        root = np.sqrt(values[kept])
        return cls(mean, (vectors[:, kept] / root).T @ rows), vectors[:, kept] * root

    def combined(self, coefficients: FloatArray) -> FloatArray:
        """The vectors of coefficients (..., r), shape (..., m)."""
        return np.asarray(self.mean + coefficients @ self.vectors)

"""A finite-basis network: hidden units that live in overlapping windows which sum to one.

Every centre c has a window w = (1 - |x - c|^2 / R^2)^3 and m + 1 units in it: a constant and m ridges
tanh(s . (x - c) / R + b). Dividing the windows by their sum (Shepard) makes them a partition of unity, so
that the network can be any constant, and any smooth function that the ridges follow within a window. After
Moseley, Markham and Nissen-Meyer, Finite basis physics-informed neural networks, Adv. Comput. Math. 49
(2023), and Shepard, A two-dimensional interpolation function for irregularly-spaced data, Proc. 23rd ACM
National Conference (1968).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from geometry.arrays import FloatArray, IntArray
from geometry.errors import UserError
from geometry.locate import Location
from solvers.pinn.trial_space import BaseFactor


class UnitMatrices(NamedTuple):
    """Values and derivatives of U units at n points, each a sparse matrix (n, U)."""

    values: csr_matrix
    along_x: csr_matrix
    along_y: csr_matrix


@dataclass(frozen=True, eq=False)
class LocalUnits:
    """Weights of the units in c windows.

    Attributes:
        centres: Shape (c, 2), mm.
        radii: Radii of the windows, shape (c,), mm.
        slopes: Slopes of the ridges per radius, shape (c, m, 2).
        biases: Biases of the ridges, shape (c, m).
        factor: The hard condition on the base.
    """

    centres: FloatArray
    radii: FloatArray
    slopes: FloatArray
    biases: FloatArray
    factor: BaseFactor

    @property
    def count(self) -> int:
        """Number of units."""
        return len(self.centres) * (self.slopes.shape[1] + 1)

    @classmethod
    def around(
        cls,
        centres: FloatArray,
        radii: FloatArray,
        *,
        ridges: int,
        slope: float,
        factor: BaseFactor,
        rng: np.random.Generator,
    ) -> "LocalUnits":
        """Units with ridges in directions spread over the half circle, turned and shifted at random."""
        count = len(centres)
        turn = rng.uniform(0, np.pi, (count, 1)) + np.pi * np.arange(ridges) / ridges
        angle = turn + rng.uniform(-0.2, 0.2, (count, ridges))
        slopes = slope * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        return cls(centres, radii, slopes, rng.uniform(-1, 1, (count, ridges)), factor)

    def matrices(self, points: FloatArray) -> UnitMatrices:
        """The units times the hard condition's factor at points (n, 2), mm.

        Raises:
            UserError: If a point lies in no window.
        """
        point, window = self._pairs(points)
        radius = self.radii[window, None]
        local = (points[point] - self.centres[window]) / radius
        rise = 1 - (local**2).sum(axis=1)
        share, share_x, share_y = _partition_of_unity(
            point, len(points), rise**3, -6 * rise[:, None] ** 2 * local / radius
        )
        slopes = self.slopes[window]
        ridge = np.tanh(np.einsum("pmx,px->pm", slopes, local) + self.biases[window])
        rate = (1 - ridge**2) / radius
        one, zero = np.ones((len(point), 1)), np.zeros((len(point), 1))
        unit = np.concatenate([one, ridge], axis=1)
        unit_x = np.concatenate([zero, rate * slopes[:, :, 0]], axis=1)
        unit_y = np.concatenate([zero, rate * slopes[:, :, 1]], axis=1)
        factor, factor_slope = (array[point] for array in self.factor.at(points))
        value = share * unit
        return UnitMatrices(
            self._matrix(len(points), point, window, factor * value),
            self._matrix(
                len(points),
                point,
                window,
                factor * (share_x * unit + share * unit_x) + factor_slope * value,
            ),
            self._matrix(len(points), point, window, factor * (share_y * unit + share * unit_y)),
        )

    def _pairs(self, points: FloatArray) -> tuple[IntArray, IntArray]:
        """Every point with every window that holds it, sorted by point; two arrays of numbers."""
        found = cKDTree(points).query_ball_point(self.centres, self.radii * (1 - 1e-9))
        window = np.repeat(np.arange(len(found)), [len(inside) for inside in found])
        point = np.fromiter(
            (index for inside in found for index in inside), dtype=np.int64, count=len(window)
        )
        order = np.argsort(point, kind="stable")
        return point[order], window[order]

    def _matrix(self, rows: int, point: IntArray, window: IntArray, values: FloatArray) -> csr_matrix:
        units = values.shape[1]
        columns = window[:, None] * units + np.arange(units)
        starts = np.concatenate([[0], np.cumsum(np.bincount(point, minlength=rows))]) * units
        return csr_matrix((values.ravel(), columns.ravel(), starts), shape=(rows, self.count))


def _partition_of_unity(
    point: IntArray, count: int, window: FloatArray, gradient: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Windows over their sum at each point, and the derivatives of that, each (pairs, 1)."""
    total = np.bincount(point, window, count)
    if (total <= 0).any():
        raise UserError(
            f"{int((total <= 0).sum())} points lie in no window of the network; take a smaller spacing"
        )
    share = window / total[point]
    along = (
        (gradient[:, axis] - share * np.bincount(point, gradient[:, axis], count)[point]) / total[point]
        for axis in range(2)
    )
    share_x, share_y = (derivative[:, None] for derivative in along)
    return share[:, None], share_x, share_y


@dataclass(frozen=True, eq=False)
class LocalField:
    """A trained finite-basis network as a displacement field.

    Attributes:
        units: The hidden units.
        output: Output layer, shape (U, 2), mm.
    """

    units: LocalUnits
    output: FloatArray

    def displacement(self, location: Location) -> FloatArray:
        """Displacement, shape (n, 2), mm."""
        return np.asarray(self.units.matrices(location.points).values @ self.output)

    def gradient(self, location: Location) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 2, 2)."""
        matrices = self.units.matrices(location.points)
        return np.stack([matrices.along_x @ self.output, matrices.along_y @ self.output], axis=-1)

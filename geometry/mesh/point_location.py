"""Point location: the triangle and the barycentric coordinates of points."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from pinnray.runtime.arrays import FloatArray, IntArray, frozen_array
from pinnray.runtime.errors import OutsideBodyError
from pinnray.runtime.notebook import brief


@dataclass(frozen=True, eq=False)
class LocatedPoints:
    """Points in the body with the triangle of each."""

    points: FloatArray  # shape (n, 2), mm
    cells: IntArray  # numbers of the triangles, shape (n,)
    barycentric: FloatArray  # coordinates in them, shape (n, 3)

    __repr__ = brief

    def __len__(self) -> int:
        return len(self.points)


class Locator:
    """Point location among the nearest centroids, with more of them until the triangle is found."""

    def __init__(self, points: FloatArray, triangles: IntArray) -> None:
        corners = points[triangles]
        self._centroids = cKDTree(corners.mean(axis=1))
        self._radius = np.linalg.norm(corners - corners.mean(axis=1, keepdims=True), axis=2).max()
        self._origin = corners[:, 0]
        across = corners - np.roll(corners, -1, axis=1)  # the sides beside corners 2, 0 and 1
        double = np.abs(across[:, 0, 0] * across[:, 1, 1] - across[:, 0, 1] * across[:, 1, 0])
        self._heights = double[:, None] / np.roll(np.linalg.norm(across, axis=2), -1, axis=1)
        self._inverse = np.linalg.inv((corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1))

    def locate(self, points: ArrayLike, slack: float = 0.0) -> LocatedPoints:
        """Locate points.

        Args:
            points: Shape (n, 2), mm.
            slack: Distance from the body up to which a point counts to the nearest triangle, mm; it then has
                a negative barycentric coordinate.

        Raises:
            OutsideBodyError: If a point lies outside the body by more than that.
        """
        where = frozen_array(points, dtype=np.float64, shape=(None, 2), name="points")
        cells = np.full(len(where), -1, dtype=np.int64)
        barycentric = np.zeros((len(where), 3))
        todo = np.arange(len(where))
        neighbours = 8
        while len(todo):
            count = min(neighbours, self._centroids.n)
            distance, candidates = self._centroids.query(where[todo], k=count)
            distance, candidates = distance.reshape(-1, count), candidates.reshape(-1, count)
            away = where[todo][:, None] - self._origin[candidates]
            local = np.einsum("nkij,nkj->nki", self._inverse[candidates], away)
            all_three = np.concatenate([1 - local.sum(axis=2, keepdims=True), local], axis=2)
            rows, best = np.arange(len(todo)), all_three.min(axis=2).argmax(axis=1)
            found = all_three[rows, best].min(axis=1) >= -1e-9  # rounding on edges
            # A triangle reaches at most _radius from its centroid: beyond it no candidate is left.
            exhausted = ~found & ((distance[:, -1] > self._radius + slack) | (count == self._centroids.n))
            if slack > 0:
                beyond = (-all_three * self._heights[candidates]).max(axis=2)
                close = exhausted & (beyond.min(axis=1) <= slack)
                best[close] = beyond[close].argmin(axis=1)
                found, exhausted = found | close, exhausted & ~close
            cells[todo[found]] = candidates[rows, best][found]
            barycentric[todo[found]] = all_three[rows, best][found]
            if exhausted.any():
                x, y = where[todo[exhausted][0]]
                raise OutsideBodyError(
                    f"{int(exhausted.sum())} of {len(where)} points lie outside the body, "
                    f"the first at ({x:.6g}, {y:.6g}) mm; fields exist in the body only"
                )
            todo = todo[~found]
            neighbours *= 4
        return LocatedPoints(points=where, cells=cells, barycentric=barycentric)

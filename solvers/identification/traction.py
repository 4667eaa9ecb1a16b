"""The contact as a traction on the front face: place, width and force are unknown.

At the abscissa x the density is the raised cosine 1 + cos(2 π (x - position) / width) within half a width,
scaled to the integral one: smooth in both parameters, zero at both ends.
"""

from dataclasses import dataclass

import numpy as np

from geometry.arrays import FloatArray
from geometry.mesh.quadrature import segment_quadrature
from geometry.mesh.triangle_mesh import TriangleMesh

POINTS_ON_EDGE = 12
"""Gauss points on an edge of the front."""


@dataclass(frozen=True, eq=False)
class FrontTraction:
    """Quadrature points of the front face and the weights of a traction there.

    Attributes:
        points: Shape (q, 2), mm.
        lengths: Their quadrature weights, shape (q,), mm.
        length: Extent of the front along x, mm.
        resolution: Length of its longest edge, mm.
    """

    points: FloatArray
    lengths: FloatArray
    length: float
    resolution: float

    @classmethod
    def of(cls, mesh: TriangleMesh) -> "FrontTraction":
        """On the front face of a mesh."""
        start, end = mesh.points[mesh.boundary("front")].transpose(1, 0, 2)
        points, lengths = segment_quadrature(start, end, POINTS_ON_EDGE)
        longest = float(np.linalg.norm(end - start, axis=1).max())
        return cls(points, lengths, float(np.ptp(mesh.points[mesh.boundary("front"), 0])), longest)

    @property
    def ends(self) -> tuple[float, float]:
        """Abscissae of the first and the last point, mm."""
        return float(self.points[:, 0].min()), float(self.points[:, 0].max())

    def weights(self, position: float, width: float) -> FloatArray:
        """Weights (5, q) of the traction w, 1/mm, and of its derivatives by position x and width b.

        The rows are w, which sums to one, dw/dx, dw/db, d²w/dx² and d²w/dx db.
        """
        offset = self.points[:, 0] - position
        inside = np.abs(offset) < 0.5 * width
        wave = 2 * np.pi / width
        stretch = offset / width
        cosine, sine = np.cos(wave * offset), np.sin(wave * offset)
        rows = np.stack(
            [
                1 + cosine,
                wave * sine,
                wave * sine * stretch,
                -(wave**2) * cosine,
                -(wave**2) * cosine * stretch - wave * sine / width,
            ]
        )
        rows = np.where(inside, rows, 0.0) * self.lengths
        total, by_x, by_b, by_xx, by_xb = rows.sum(axis=1)
        w = rows[0] / total
        w_x, w_b = (rows[1] - by_x * w) / total, (rows[2] - by_b * w) / total
        w_xx = (rows[3] - by_xx * w - 2 * by_x * w_x) / total
        w_xb = (rows[4] - by_xb * w - by_x * w_b - by_b * w_x) / total
        return np.stack([w, w_x, w_b, w_xx, w_xb])

    def tangent(self, position: float) -> FloatArray:
        """Unit vector along the front toward greater x at an abscissa, mm, shape (2,)."""
        order = self.points[:, 0].argsort()
        x, y = self.points[order].T
        reach = 0.02 * self.length
        low, high = (np.interp(position + side * reach, x, y) for side in (-1, 1))
        along = np.array([2 * reach, high - low])
        return np.asarray(along / np.linalg.norm(along))

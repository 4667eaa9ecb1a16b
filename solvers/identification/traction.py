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
        """Weights (3, q) of the traction and their derivatives by position and width, 1/mm.

        The first row sums to one.
        """
        offset = self.points[:, 0] - position
        phase = 2 * np.pi * offset / width
        inside = np.abs(offset) < 0.5 * width
        density = np.where(inside, 1 + np.cos(phase), 0.0) * self.lengths
        turned = np.where(inside, 2 * np.pi / width * np.sin(phase), 0.0) * self.lengths
        rows = np.stack([density, turned, turned * offset / width])
        total = rows.sum(axis=1)
        normalised = rows[0] / total[0]
        return np.stack([normalised, *((rows[1:] - total[1:, None] * normalised) / total[0])])

    def tangent(self, position: float) -> FloatArray:
        """Unit vector along the front toward greater x at an abscissa, mm, shape (2,)."""
        order = self.points[:, 0].argsort()
        x, y = self.points[order].T
        reach = 0.02 * self.length
        low, high = (np.interp(position + side * reach, x, y) for side in (-1, 1))
        along = np.array([2 * reach, high - low])
        return np.asarray(along / np.linalg.norm(along))

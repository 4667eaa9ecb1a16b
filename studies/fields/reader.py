"""The reader of a displacement field: von Mises stress at the nodes, tip, wrap and largest stress."""

from functools import cached_property
from itertools import product

import numpy as np
from scipy.spatial import cKDTree

from pinnray.geometry.mesh.boundary import mean_thickness, singular_points
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray
from pinnray.solvers.elasticity import Lame, LawName, stress_of, von_mises
from pinnray.solvers.finger_figures.measures import turn
from pinnray.solvers.lagrange import EDGES, LagrangeSpace

FIGURES = ("force", "tip_u", "tip_v", "wrap", "von_mises", "contact_width")
"""Figures of `solvers.finger_figures` that an emulator of fields gives, and the contact's width, mm."""


class FieldReader:
    """Reads displacements of the nodes of quadratic elements on a mesh, or on one that has moved.

    Args:
        mesh: At rest.
    """

    def __init__(self, mesh: TriangleMesh) -> None:
        front = np.unique(mesh.boundary("front"))
        order = np.argsort(mesh.points[front, 0])
        self.mesh, self.front = mesh, front[order]
        ends = mesh.points[mesh.boundary("contact").ravel(), 0]
        self.contact_width = float(ends.max() - ends.min())
        self.thickness = mean_thickness(mesh)

    @cached_property
    def away(self) -> BoolArray:
        """Mask of the nodes that are further from singular points than the walls are thick, shape (n,)."""
        near = cKDTree(singular_points(self.mesh)).query(self.mesh.points)[0]
        return np.asarray(near > self.thickness)

    @cached_property
    def _corner_gradients(self) -> FloatArray:
        """Derivatives by λ of the six shape functions at the three corners, shape (9, 6)."""
        found = np.zeros((3, 3, 6))  # corner, λ, function
        for corner in range(3):
            found[corner, range(3), range(3)] = np.where(np.arange(3) == corner, 3.0, -1.0)
            for middle, (first, second) in enumerate(EDGES):
                found[corner, second, 3 + middle] = 4.0 * (first == corner)
                found[corner, first, 3 + middle] = 4.0 * (second == corner)
        return found.reshape(9, 6)

    @cached_property
    def _cells(self) -> IntArray:
        return np.ascontiguousarray(LagrangeSpace(self.mesh, 2).cell_nodes.T)

    def stress(self, points: FloatArray, nodal: FloatArray, law: LawName, lame: Lame) -> FloatArray:
        """Von Mises stress at the nodes (n, 2), by the gradient's mean over their triangles: (n,), MPa."""
        return stress_at(self.gradients(points, nodal[None])[0], law, lame)

    def gradients(self, points: FloatArray, nodal: FloatArray) -> FloatArray:
        """Means over a node's triangles of the gradients of displacements (s, N, 2): shape (s, n, 2, 2)."""
        triangles, count = self.mesh.triangles.T, len(points)
        corners = points[triangles]  # (3, t, 2)
        opposite = np.roll(corners, -2, axis=0) - np.roll(corners, -1, axis=0)
        slopes = np.stack([-opposite[..., 1], opposite[..., 0]])  # along x and y, times twice the area
        double = slopes[0, 0] * slopes[1, 1] - slopes[1, 0] * slopes[0, 1]
        # The mean is weighted by areas: gradients times twice the area are summed.
        nodes, weights = triangles.ravel(), np.bincount(triangles.ravel(), np.tile(double, 3), count)
        gradients = np.empty((len(nodal), count, 2, 2))
        for gradient, each in zip(gradients, nodal, strict=True):
            moved = each[self._cells]  # (6, t, 2)
            by_λ = (self._corner_gradients @ moved.reshape(6, -1)).reshape(3, 3, *moved.shape[1:])
            for axis, along in product(range(2), range(2)):
                found = np.einsum("clt,lt->ct", by_λ[..., axis], slopes[along])
                gradient[:, axis, along] = np.bincount(nodes, found.ravel(), count) / weights
        return gradients

    def counted(self, points: FloatArray, position: float) -> BoolArray:
        """Mask of the nodes away from singular points and from a contact about an abscissa, mm, (n,)."""
        beside = np.maximum(np.abs(points[:, 0] - position) - 0.5 * self.contact_width, 0.0)
        return np.asarray(self.away & (np.hypot(beside, points[:, 1]) > self.thickness))

    def figures(
        self, points: FloatArray, nodal: FloatArray, stress: FloatArray, position: float
    ) -> tuple[float, float, float, float]:
        """Displacement of the tip along and across, mm, wrap, degrees, and largest stress, MPa."""
        base, tip = self.front[[0, -1]]
        x = points[self.front, 0]
        middle = np.array(
            [np.interp(position, x, each) for each in (*points[self.front].T, *nodal[self.front].T)]
        )
        before = np.array([points[base], middle[:2], points[tip]])
        after = before + np.array([nodal[base], middle[2:], nodal[tip]])
        counted = self.counted(points, position)
        u, v = map(float, nodal[tip])
        return u, v, turn(after) - turn(before), float(stress[counted].max())


def stress_at(gradients: FloatArray, law: LawName, lame: Lame) -> FloatArray:
    """Von Mises stress of displacement gradients (n, 2, 2), shape (n,), MPa."""
    stress, across = stress_of(law, gradients, lame)
    return von_mises(stress, stress_zz=across)

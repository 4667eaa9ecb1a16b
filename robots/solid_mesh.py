"""The section extruded to a body of linear tetrahedra, in metres.

A triangle times a layer is a prism of three tetrahedra, cut as in `solvers.extrusion`. The frame is the
section's: x from the base to the tip, y out of the front face; z = 0 is in the middle of the depth.
"""

from dataclasses import dataclass

import numpy as np

from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.robots.chain import MM
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.solvers.extrusion import ExtrudedSpace
from pinnray.solvers.lagrange import LagrangeSpace


@dataclass(frozen=True, eq=False)
class SolidMesh:
    """Tetrahedra of an extruded section.

    Node `level * P + k` is above node k of the section's P nodes.
    """

    section: TriangleMesh
    points: FloatArray  #: Shape (n, 3), m
    tetrahedra: IntArray  #: Node numbers, shape (t, 4), of positive volume

    @classmethod
    def of(cls, section: TriangleMesh, layers: int) -> "SolidMesh":
        """The body in so many layers of one thickness through the depth."""
        space = ExtrudedSpace(LagrangeSpace(section, 2), np.linspace(0.0, section.depth, layers + 1))
        levels = space.faces - section.depth / 2
        count = len(section.points)
        points = MM * np.column_stack([np.tile(section.points, (layers + 1, 1)), np.repeat(levels, count)])
        cells = space.cells.copy()
        backward = _volumes(points, cells) < 0
        cells[backward, :2] = cells[backward, 1::-1]
        return cls(section, points, cells)

    @property
    def volume(self) -> float:
        """Of the body, m^3."""
        return float(_volumes(self.points, self.tetrahedra).sum())

    @property
    def levels(self) -> int:
        """Number of layers of nodes."""
        return len(self.points) // len(self.section.points)

    def nodes_on(self, name: str) -> IntArray:
        """Nodes on a named boundary of the section, at every level, shape (k,)."""
        flat = np.unique(self.section.boundary(name))
        return np.asarray((flat + len(self.section.points) * np.arange(self.levels)[:, None]).ravel())


def _volumes(points: FloatArray, cells: IntArray) -> FloatArray:
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    return np.asarray(np.linalg.det(edges) / 6)

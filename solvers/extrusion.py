"""The shared mesh extruded through half of the depth, with quadratic elements on tetrahedra.

A triangle times a layer is a prism of three tetrahedra. Its corners in one order of all corners of the mesh,
a < b < c below and a', b', c' above, give the tetrahedra (a, b, c, c'), (a, b, b', c'), (a, a', b', c'): the
diagonal of a face between two prisms starts at its first corner below in both (J. Dompierre, P. Labbé,
M.-G. Vallet, R. Camarero, How to subdivide pyramids, prisms and hexahedra into tetrahedra, 8th International
Meshing Roundtable, 1999). Corners are ordered by x, then y, whatever their numbers.

The quadratic tetrahedra have their nodes above the quadratic triangles' nodes, at the layers' faces and
middles: a lattice.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray
from pinnray.solvers.lagrange import LagrangeSpace


@dataclass(frozen=True, eq=False)
class ExtrudedSpace:
    """Scalar quadratic elements on the half 0 <= z <= depth / 2 of a body, from its middle plane to a face.

    Node `level * P + k` is node k of the section's P quadratic nodes, at `levels[level]`.
    """

    section: LagrangeSpace  # Quadratic elements on the shared mesh
    faces: FloatArray  # Places of the layers' faces, from 0 to half of the depth, shape (layers + 1,), mm
    held: bool = False  # Whether the side faces cannot move along z, so that the body is in plane strain
    degree: ClassVar[int] = 2

    @classmethod
    def of(cls, mesh: TriangleMesh, layers: int, grading: float, held: bool = False) -> "ExtrudedSpace":
        """The half body of a mesh in layers.

        `grading` is the thickness of the layer at the side face over the thickness at the middle plane.
        """
        thickness = np.geomspace(1.0, grading, layers)
        faces = np.concatenate([[0.0], np.cumsum(thickness)])
        return cls(LagrangeSpace(mesh, 2), 0.5 * mesh.depth * faces / faces[-1], held)

    @property
    def mesh(self) -> TriangleMesh:
        """The section's mesh."""
        return self.section.mesh

    @property
    def thickness(self) -> float:
        """Extent by which integrals are divided: half of the depth, mm, so that they are per depth."""
        return float(self.faces[-1])

    @cached_property
    def levels(self) -> FloatArray:
        """Places of the nodes along z, shape (2 layers + 1,), mm."""
        levels = np.empty(2 * len(self.faces) - 1)
        levels[::2], levels[1::2] = self.faces, 0.5 * (self.faces[1:] + self.faces[:-1])
        return levels

    @cached_property
    def nodes(self) -> FloatArray:
        """Node positions, shape (N, 3), mm."""
        flat = self.section.nodes
        return np.column_stack([np.tile(flat, (len(self.levels), 1)), np.repeat(self.levels, len(flat))])

    @cached_property
    def vertices(self) -> IntArray:
        """The nodes that are corners, which lie on the layers' faces, shape (V,)."""
        starts = 2 * len(self.section.nodes) * np.arange(len(self.faces))
        return np.asarray((starts[:, None] + np.arange(len(self.mesh.points))).ravel(), dtype=np.int64)

    @cached_property
    def cells(self) -> IntArray:
        """Corners of every tetrahedron, shape (3 t layers, 4), as rows of `vertices`."""
        count, points = len(self.mesh.points), self.mesh.points
        rank = np.empty(count, dtype=np.int64)
        rank[np.lexsort((points[:, 1], points[:, 0]))] = np.arange(count)
        triangles = self.mesh.triangles
        ordered = np.take_along_axis(triangles, rank[triangles].argsort(axis=1), axis=1)
        a, b, c = ordered.T
        above = ordered.T + count
        prism = np.array([[a, b, c, above[2]], [a, b, above[1], above[2]], [a, *above]])
        first = prism.transpose(2, 0, 1).reshape(-1, 4)
        starts = count * np.arange(len(self.faces) - 1)
        return np.asarray((starts[:, None, None] + first).reshape(-1, 4), dtype=np.int64)

    def edge_nodes(self, edges: IntArray) -> IntArray:
        """Nodes in the middles of edges given as pairs of nodes, shape (..., 2)."""
        level, node = np.divmod(edges, len(self.section.nodes))
        first, second = node[..., 0], node[..., 1]
        upright = first == second
        # An upright edge is none of the section's; its middle is above its own end.
        middle = np.where(upright, first, 0)
        middle[~upright] = self.section.edge_nodes(node[~upright])
        return np.asarray(level.sum(axis=-1) // 2 * len(self.section.nodes) + middle, dtype=np.int64)

    def boundary_nodes(self, name: str) -> IntArray:
        """Nodes on a named boundary of the section, at every level, each once."""
        starts = len(self.section.nodes) * np.arange(len(self.levels))
        nodes = starts[:, None] + self.section.boundary_nodes(name)
        return np.asarray(nodes.ravel(), dtype=np.int64)

    @property
    def mirrored(self) -> BoolArray:
        """Components held by symmetry in the middle plane, and u_z on side faces that are held, (N, 3)."""
        mask = np.zeros(self.nodes.shape, dtype=bool)
        mask[: len(self.section.nodes), 2] = True
        mask[-len(self.section.nodes) :, 2] = self.held
        return mask

    @cached_property
    def shares(self) -> FloatArray:
        """Weights of the levels in a mean over the depth, by Simpson's rule, shape (2 layers + 1,)."""
        shares = np.zeros(len(self.levels))
        for start, height in zip(2 * np.arange(len(self.faces) - 1), np.diff(self.faces), strict=True):
            shares[start : start + 3] += height / 6 * np.array([1, 4, 1])
        return shares / self.thickness

    def mean_value(self, points: FloatArray, weights: FloatArray) -> FloatArray:
        """Weights of the nodes in a weighted sum over points (q, 2), meant over z, shape (N,)."""
        return np.asarray(np.kron(self.shares, self.section.mean_value(points, weights)))

    def extruded(self, values: FloatArray) -> FloatArray:
        """Nodal values, shape (N, 3), that repeat a displacement (P, 2) of the section at every level."""
        return np.tile(np.column_stack([values, np.zeros(len(values))]), (len(self.levels), 1))

    def at_level(self, nodal: FloatArray, level: int) -> FloatArray:
        """The values of one level, shape (P, 3), of nodal values of shape (N, 3); -1 is the side face."""
        return np.asarray(nodal.reshape(len(self.levels), -1, 3)[level])


NodalSpace = LagrangeSpace | ExtrudedSpace
"""Scalar Lagrange elements on simplices, for a section or its extrusion."""

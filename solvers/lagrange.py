"""Continuous Lagrange elements on the shared mesh, in NumPy: nodes, shape functions, functionals, evaluation.

DOLFINx assembles and PETSc solves; nodes here are matched to their degrees of freedom by position, so that a
finite-element solution is an array that does not depend on how they number things.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from scipy.sparse import csr_matrix

from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray

# Edge k joins the corners EDGES[k]; its node is number 3 + k of a quadratic element.
EDGES = np.array([[0, 1], [1, 2], [2, 0]])


@dataclass(frozen=True, eq=False)
class LagrangeSpace:
    """Scalar elements of degree 1 or 2; the mesh's nodes come first, then the middles of `mesh.edges`.

    `section`, `thickness`, `shares` and `mirrored` are what it has in common with `ExtrudedSpace`.
    """

    mesh: TriangleMesh
    degree: int  # 1 or 2
    thickness: ClassVar[float] = 1.0  # By which integrals are divided, mm, as they are per depth
    shares: ClassVar[FloatArray] = np.ones(1)  # Weights in a mean over the levels of an extrusion, here one

    @cached_property
    def nodes(self) -> FloatArray:
        """Node positions, shape (N, 2), mm."""
        if self.degree == 1:
            return self.mesh.points
        return np.concatenate([self.mesh.points, self.mesh.points[self.mesh.edges].mean(axis=1)])

    @property
    def cells(self) -> IntArray:
        """Rows of `vertices` at the corners of every triangle, shape (t, 3)."""
        return self.mesh.triangles

    @property
    def vertices(self) -> IntArray:
        """The nodes that are corners, which come first, shape (V,)."""
        return np.arange(len(self.mesh.points))

    @property
    def section(self) -> "LagrangeSpace":
        """Itself."""
        return self

    @property
    def mirrored(self) -> BoolArray:
        """Components that symmetry holds at zero: none, mask of shape (N, 2)."""
        return np.zeros((len(self.nodes), 2), dtype=bool)

    def extruded(self, values: FloatArray) -> FloatArray:
        """The nodal values themselves, shape (N, 2)."""
        return np.asarray(values)

    @cached_property
    def cell_nodes(self) -> IntArray:
        """Nodes of every element, shape (t, 3) or (t, 6)."""
        if self.degree == 1:
            return self.mesh.triangles
        return np.concatenate([self.mesh.triangles, self.edge_nodes(self.mesh.triangles[:, EDGES])], axis=1)

    def boundary_nodes(self, name: str) -> IntArray:
        """Nodes on a named boundary, each once."""
        edges = self.mesh.boundary(name)
        nodes = np.unique(edges)
        if self.degree == 1:
            return nodes
        return np.concatenate([nodes, self.edge_nodes(edges)])

    def edge_nodes(self, edges: IntArray) -> IntArray:
        """Nodes in the middles of edges given as pairs of nodes, shape (..., 2), for degree 2."""
        return len(self.mesh.points) + self.mesh.edge_numbers(edges)

    def mean_value(self, points: FloatArray, weights: FloatArray) -> FloatArray:
        """Weights of the nodes in a weighted sum over points (q, 2), shape (N,)."""
        return np.asarray(self.shape_functions(self.mesh.locate(points)).T @ weights)

    def at_nodes(self) -> LocatedPoints:
        """The location of every node, in the order of the nodes."""
        corners = np.eye(3)
        barycentric = np.concatenate([corners, corners[EDGES].mean(axis=1)])[: self.cell_nodes.shape[1]]
        cells, local = (np.zeros(len(self.nodes), dtype=np.int64) for _ in range(2))
        for number, nodes in enumerate(self.cell_nodes.T):
            cells[nodes] = np.arange(len(nodes))
            local[nodes] = number
        return LocatedPoints(points=self.nodes, cells=cells, barycentric=barycentric[local])

    def shape_functions(self, location: LocatedPoints) -> csr_matrix:
        """Values of the shape functions, as a matrix (n, N) that maps nodal values to values at points."""
        λ = location.barycentric
        if self.degree == 1:
            return self._matrix(location, λ)
        corners = λ * (2 * λ - 1)
        middles = 4 * λ[:, EDGES[:, 0]] * λ[:, EDGES[:, 1]]
        return self._matrix(location, np.concatenate([corners, middles], axis=1))

    def shape_gradients(self, location: LocatedPoints) -> tuple[csr_matrix, csr_matrix]:
        """Derivatives of the shape functions along x and y, each a matrix (n, N), 1/mm."""
        λ, (first, second) = location.barycentric, EDGES.T
        found = []
        for axis in range(2):
            gradients = dλ = self._barycentric_gradients[axis, location.cells]
            if self.degree == 2:
                middles = 4 * (λ[:, first] * dλ[:, second] + λ[:, second] * dλ[:, first])
                gradients = np.concatenate([(4 * λ - 1) * dλ, middles], axis=1)
            found.append(self._matrix(location, gradients))
        return found[0], found[1]

    @cached_property
    def _barycentric_gradients(self) -> FloatArray:
        """Derivatives of the barycentric coordinates along x and y, shape (2, t, 3), 1/mm."""
        corners = self.mesh.points[self.mesh.triangles]
        opposite = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
        rotated = np.stack([-opposite[..., 1], opposite[..., 0]])
        return np.asarray(rotated / (2 * self.mesh.areas)[:, None], dtype=np.float64)

    def _matrix(self, location: LocatedPoints, values: FloatArray) -> csr_matrix:
        columns = self.cell_nodes[location.cells]
        rows = np.arange(len(location) + 1) * columns.shape[1]
        return csr_matrix((values.ravel(), columns.ravel(), rows), shape=(len(location), len(self.nodes)))


@dataclass(frozen=True, eq=False)
class LagrangeField:
    """A finite-element displacement field."""

    space: LagrangeSpace  # The elements
    values: FloatArray  # Nodal displacements, shape (N, 2), mm

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement, shape (n, 2), mm."""
        return np.asarray(self.space.shape_functions(location) @ self.values)

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 2, 2)."""
        dx, dy = self.space.shape_gradients(location)
        return np.stack([dx @ self.values, dy @ self.values], axis=-1)

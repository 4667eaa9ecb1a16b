"""Extension of values on a mesh's boundary to the nodes within: of least energy."""

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.linalg import splu

from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray

POISSON = 0.3
"""Poisson's ratio of the elastic body; where triangles are stretched matters little."""


class Extension:
    """Values at the nodes of a mesh with the least energy for those on its boundary.

    Args:
        mesh: The mesh.
        stiffness: Matrix of the energy, of one or several values for each node, in the order of the nodes.
    """

    def __init__(self, mesh: TriangleMesh, stiffness: csr_matrix) -> None:
        inner = np.ones(len(mesh.points), dtype=bool)
        inner[np.unique(mesh.boundary_edges)] = False
        self._free = np.repeat(inner, stiffness.shape[0] // len(inner))
        self._rows = stiffness[self._free]
        self._factors = splu(self._rows[:, self._free].tocsc()) if inner.any() else None

    def of(self, values: FloatArray) -> FloatArray:
        """All values, shape (n, k), from those on the boundary; others are not read."""
        found = values.reshape(len(self._free), -1).copy()
        found[self._free] = 0.0
        if self._factors is not None and found.size:
            found[self._free] = self._factors.solve(np.ascontiguousarray(-(self._rows @ found)))
        return found.reshape(values.shape)


def barycentric_gradients(mesh: TriangleMesh) -> FloatArray:
    """Gradients of the barycentric coordinates, shape (t, 3, 2), 1/mm."""
    corners = mesh.points[mesh.triangles]
    opposite = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    rotated = np.stack([-opposite[..., 1], opposite[..., 0]], axis=-1)
    return np.asarray(rotated / (2 * mesh.areas)[:, None, None], dtype=np.float64)


def elastic(mesh: TriangleMesh) -> Extension:
    """The motion of an elastic body whose modulus is one over the area of a triangle.

    Small triangles at corners move nearly as rigid bodies and do not turn over. Plane stress.

    Source: K. Stein, T. Tezduyar, R. Benney, Journal of Applied Mechanics 70 (2003) 58-63.
    """
    slopes = barycentric_gradients(mesh)
    strains = np.zeros((len(slopes), 3, 3, 2))  # component, corner, axis
    strains[:, 0, :, 0] = strains[:, 2, :, 1] = slopes[..., 0]
    strains[:, 1, :, 1] = strains[:, 2, :, 0] = slopes[..., 1]
    strains = strains.reshape(-1, 3, 6)
    shear = (1 - POISSON) / 2
    law = np.array([[1, POISSON, 0], [POISSON, 1, 0], [0, 0, shear]]) / (1 - POISSON**2)
    blocks = np.einsum("tai,ab,tbj->tij", strains, law, strains, optimize=True)  # area over area
    places = (2 * mesh.triangles[:, :, None] + np.arange(2)).reshape(-1, 6)
    rows, columns = np.repeat(places, 6, axis=1), np.tile(places, 6)
    size = 2 * len(mesh.points)
    stiffness = coo_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), (size, size)).tocsr()
    return Extension(mesh, stiffness)

"""Motion of the nodes within a body whose boundary moves: that of an elastic body of stiff small triangles.

Source: K. Stein, T. Tezduyar, R. Benney, Journal of Applied Mechanics 70 (2003) 58-63: Young's modulus over
the area of a triangle, so that the small ones at corners move nearly as rigid bodies and do not turn over.
"""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray

POISSON = 0.3
"""Poisson's ratio of the body; where triangles are stretched matters little."""


class ElasticMotion:
    """Extends motions of a mesh's boundary to its inner nodes; factorised once.

    Args:
        mesh: Before the motion.
    """

    def __init__(self, mesh: TriangleMesh) -> None:
        count = len(mesh.points)
        stiffness = _stiffness(mesh)
        inner = np.ones(count, dtype=bool)
        inner[np.unique(mesh.boundary_edges)] = False
        self._free = np.repeat(inner, 2)
        self._rows = stiffness[self._free]
        self._factors = splu(self._rows[:, self._free].tocsc()) if inner.any() else None

    def extended(self, motion: FloatArray) -> FloatArray:
        """The motion of all nodes, shape (n, 2), mm, from that of the boundary's; others are not read."""
        found = np.where(self._free, 0.0, motion.ravel())
        if self._factors is not None:
            found[self._free] = self._factors.solve(-(self._rows @ found))
        return found.reshape(-1, 2)


def _stiffness(mesh: TriangleMesh) -> coo_matrix:
    """Stiffness matrix of linear triangles, shape (2 n, 2 n), of the modulus one over the area."""
    corners = mesh.points[mesh.triangles]
    opposite = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    slopes = np.stack([-opposite[..., 1], opposite[..., 0]], axis=-1) / (2 * mesh.areas)[:, None, None]
    strains = np.zeros((len(corners), 3, 3, 2))  # component, corner, axis
    strains[:, 0, :, 0] = strains[:, 2, :, 1] = slopes[..., 0]
    strains[:, 1, :, 1] = strains[:, 2, :, 0] = slopes[..., 1]
    strains = strains.reshape(-1, 3, 6)
    shear = (1 - POISSON) / 2
    law = np.array([[1, POISSON, 0], [POISSON, 1, 0], [0, 0, shear]]) / (1 - POISSON**2)
    blocks = np.einsum("tai,ab,tbj->tij", strains, law, strains, optimize=True)  # area over area
    places = (2 * mesh.triangles[:, :, None] + np.arange(2)).reshape(-1, 6)
    rows, columns = np.repeat(places, 6, axis=1), np.tile(places, 6)
    size = 2 * len(mesh.points)
    return coo_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), (size, size)).tocsr()

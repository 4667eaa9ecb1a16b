"""Walls and ribs of a finger, found in its mesh, and the number of elements through their thickness."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from geometry.arrays import BoolArray, FloatArray
from geometry.mesh.boundary import boundary_loops
from geometry.mesh.triangle_mesh import TriangleMesh


def walls_and_ribs(mesh: TriangleMesh) -> dict[str, BoolArray]:
    """Triangles of the `front` and `back` wall, where cavities are beside them, and of the `rib`s.

    A wall is as thick as the nearest cavity is far from its face. What remains falls into pieces: the one at
    the base and the one that reaches farthest are base and tip, the others are ribs.

    Returns:
        Masks of shape (t,), without any triangle where the finger has no such part.
    """
    inner = [mesh.points[loop] for loop in boundary_loops(mesh)[1:]]
    none = np.zeros(len(mesh.triangles), dtype=bool)
    if not inner:
        return {"front": none, "back": none, "rib": none}
    cavities = np.concatenate(inner)
    centroids = mesh.at_centroids().points
    beside = (centroids[:, 0] > cavities[:, 0].min()) & (centroids[:, 0] < cavities[:, 0].max())
    parts = {}
    for name in ("front", "back"):
        thickness = _distance(mesh, name, cavities).min()
        parts[name] = beside & (_distance(mesh, name, centroids) < thickness)
    rest = np.flatnonzero(~(parts["front"] | parts["back"]))
    corners = mesh.triangles[rest].ravel()
    touching = coo_matrix((np.ones(len(corners)), (np.repeat(np.arange(len(rest)), 3), corners))).tocsr()
    _, piece = connected_components(touching @ touching.T)
    base = np.isin(mesh.triangles[rest], mesh.boundary("base")).any(axis=1)
    ends = [*piece[base], piece[centroids[rest, 0].argmax()]]
    return parts | {"rib": np.isin(np.arange(len(none)), rest[~np.isin(piece, ends)])}


def elements_through_thickness(mesh: TriangleMesh) -> int:
    """The number of elements through the thinnest wall or rib.

    Each wall lies between the outline and a cavity and each rib between two cavities: this is the least
    number of element edges on a path from one closed boundary to another.
    """
    loop_of = np.full(len(mesh.points), -1)
    for number, loop in enumerate(boundary_loops(mesh)):
        loop_of[loop] = number
    steps = np.where(loop_of >= 0, 0, -1)
    ends = np.concatenate([mesh.edges, mesh.edges[:, ::-1]])
    level = 0
    while True:
        start, stop = loop_of[ends[:, 0]], loop_of[ends[:, 1]]
        met = (start >= 0) & (stop >= 0) & (start != stop)
        if met.any():
            return int((steps[ends[met, 0]] + steps[ends[met, 1]]).min()) + 1
        fresh = ends[(start >= 0) & (stop < 0)]
        if not len(fresh):
            return level
        level += 1
        loop_of[fresh[:, 1]] = loop_of[fresh[:, 0]]
        steps[fresh[:, 1]] = level


def _distance(mesh: TriangleMesh, face: str, points: FloatArray) -> FloatArray:
    """Distance from the straight line through a face, shape (n,), mm."""
    nodes = mesh.points[mesh.boundary(face).ravel()]
    start, end = nodes[nodes[:, 0].argmin()], nodes[nodes[:, 0].argmax()]
    along = (end - start) / np.linalg.norm(end - start)
    away = points - start
    return np.asarray(np.abs(along[0] * away[:, 1] - along[1] * away[:, 0]))

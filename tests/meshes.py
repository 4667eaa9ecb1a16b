"""Closed forms of the section, and properties and copies of meshes, that only tests need."""

import numpy as np

from pinnray.geometry.mesh.triangle_mesh import TriangleMesh


def permuted(mesh: TriangleMesh, seed: int) -> TriangleMesh:
    """The same mesh with nodes and triangles numbered in another order."""
    rng = np.random.default_rng(seed)
    order, cells = rng.permutation(len(mesh.points)), rng.permutation(len(mesh.triangles))
    new = np.argsort(order)
    return TriangleMesh(
        points=mesh.points[order],
        triangles=new[np.roll(mesh.triangles[cells], int(rng.integers(3)), axis=1)],
        boundaries={name: new[nodes] for name, nodes in mesh.boundaries.items()},
        marker_nodes=new[mesh.marker_nodes],
        contact_node=int(new[mesh.contact_node]),
    )


def smallest_angle(mesh: TriangleMesh) -> float:
    """The smallest angle of all triangles, degrees."""
    corners = mesh.points[mesh.triangles]
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    cosine = (ahead * behind).sum(axis=2) / np.linalg.norm(ahead, axis=2) / np.linalg.norm(behind, axis=2)
    return float(np.degrees(np.arccos(cosine.max())))


def corner_area(angle: float, radius: float) -> float:
    """Area that a fillet of `radius` mm cuts off a corner of `angle` radians, mm^2."""
    return float(radius**2 * (1 / np.tan(angle / 2) - (np.pi - angle) / 2))

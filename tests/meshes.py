"""Closed forms of the section, and properties and copies of meshes, that only tests need."""

import numpy as np

from geometry.arrays import FloatArray
from geometry.finger.section import Section, corner_angles, polygon_sides
from geometry.mesh.triangle_mesh import TriangleMesh


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


def boundary_lengths(section: Section) -> dict[str, float]:
    """Length of the named boundaries `base`, `front`, `back` and `contact`, mm."""
    base, back, front = polygon_sides(section.outer)
    contact = np.ptp(section.contact[:, 0])
    return {"base": float(base), "front": float(front), "back": float(back), "contact": float(contact)}


def body_area(section: Section) -> float:
    """Area of the body, mm^2, fillets included."""
    return polygon_area(section.outer) - sum(
        polygon_area(cavity)
        - sum(corner_area(angle, section.fillet_radius) for angle in corner_angles(cavity))
        for cavity in section.cavities
    )


def body_perimeter(section: Section) -> float:
    """Length of the whole boundary, the cavities' included, mm."""
    total = float(polygon_sides(section.outer).sum())
    for cavity in section.cavities:
        turns = np.pi - corner_angles(cavity)
        shortened = 2 * np.tan(turns / 2) - turns
        total += float(polygon_sides(cavity).sum() - section.fillet_radius * shortened.sum())
    return total


def polygon_area(corners: FloatArray) -> float:
    """Signed area of a polygon of shape (n, 2), mm^2; positive if counter-clockwise."""
    following = np.roll(corners, -1, axis=0)
    return float(0.5 * (corners[:, 0] * following[:, 1] - corners[:, 1] * following[:, 0]).sum())


def corner_area(angle: float, radius: float) -> float:
    """Area that a fillet of `radius` mm cuts off a corner of `angle` radians, mm^2."""
    return float(radius**2 * (1 / np.tan(angle / 2) - (np.pi - angle) / 2))

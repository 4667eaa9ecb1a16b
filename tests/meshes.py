"""Closed forms of the section, and properties and copies of meshes, that only tests need."""

import numpy as np

from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.section import cells, corner_angles
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray


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


def boundary_lengths(design: Design) -> dict[str, float]:
    """Length of `base`, `front`, `back` and `contact` of a finger without tilt, rounding and foot, mm."""
    back = float(np.hypot(design.base_width, design.height))
    return {"base": design.base_width, "front": design.height, "back": back, "contact": design.contact_width}


def body_area(design: Design) -> float:
    """Area of a finger without tilt, rounding and foot, mm^2, fillets included."""
    return 0.5 * design.base_width * design.height - sum(
        polygon_area(cell) - sum(corner_area(angle, design.fillet_radius) for angle in corner_angles(cell))
        for cell in cells(design)
    )


def body_perimeter(design: Design) -> float:
    """Length of the whole boundary of such a finger, the cavities' included, mm."""
    lengths = boundary_lengths(design)
    total = lengths["base"] + lengths["back"] + lengths["front"]
    for cell in cells(design):
        turns = np.pi - corner_angles(cell)
        shortened = 2 * np.tan(turns / 2) - turns
        sides = np.linalg.norm(np.roll(cell, -1, axis=0) - cell, axis=1)
        total += float(sides.sum() - design.fillet_radius * shortened.sum())
    return total


def polygon_area(corners: FloatArray) -> float:
    """Signed area of a polygon of shape (n, 2), mm^2; positive if counter-clockwise."""
    following = np.roll(corners, -1, axis=0)
    return float(0.5 * (corners[:, 0] * following[:, 1] - corners[:, 1] * following[:, 0]).sum())


def corner_area(angle: float, radius: float) -> float:
    """Area that a fillet of `radius` mm cuts off a corner of `angle` radians, mm^2."""
    return float(radius**2 * (1 / np.tan(angle / 2) - (np.pi - angle) / 2))

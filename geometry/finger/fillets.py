"""Fillets: points of tangency, middle and centre, for CAD, drawings and meshes."""

import numpy as np

from geometry.arrays import FloatArray
from geometry.finger.section import corner_angles


def fillet_points(corners: FloatArray, which: int, radius: float) -> FloatArray:
    """Start, middle and end of the fillet at corner `which` of a convex polygon, shape (3, 2), mm."""
    corner, (behind, ahead) = corners[which], _along_sides(corners, which)
    tangent = radius / np.tan(corner_angles(corners)[which] / 2)
    centre = fillet_centre(corners, which, radius)
    middle = centre + radius * (corner - centre) / np.linalg.norm(corner - centre)
    return np.array([corner + behind * tangent, middle, corner + ahead * tangent])


def fillet_centre(corners: FloatArray, which: int, radius: float) -> FloatArray:
    """Centre of the fillet at corner `which` of a convex polygon, shape (2,), mm."""
    bisector = _along_sides(corners, which).sum(axis=0)
    distance = radius / np.sin(corner_angles(corners)[which] / 2)
    return np.asarray(corners[which] + distance * bisector / np.linalg.norm(bisector), dtype=np.float64)


def _along_sides(corners: FloatArray, which: int) -> FloatArray:
    """Unit vectors from a corner to the one before and the one after it, shape (2, 2)."""
    sides = corners[[which - 1, (which + 1) % len(corners)]] - corners[which]
    return np.asarray(sides / np.linalg.norm(sides, axis=1, keepdims=True), dtype=np.float64)

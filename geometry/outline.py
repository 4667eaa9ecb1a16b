"""Rounded corners as points, for CAD and for drawings."""

import numpy as np

from geometry.arrays import FloatArray
from geometry.section import corner_angles


def fillet_points(corners: FloatArray, which: int, radius: float) -> FloatArray:
    """Start, middle and end of the fillet at corner `which` of a convex polygon, shape (3, 2), mm."""
    corner = corners[which]
    behind, ahead = (
        (other - corner) / np.linalg.norm(other - corner)
        for other in (corners[which - 1], corners[(which + 1) % len(corners)])
    )
    half = corner_angles(corners)[which] / 2
    bisector = (behind + ahead) / np.linalg.norm(behind + ahead)
    tangent = radius / np.tan(half)
    middle = corner + bisector * (radius / np.sin(half) - radius)
    return np.array([corner + behind * tangent, middle, corner + ahead * tangent])

"""Positions of the markers.

Both layouts are assumptions: the paper shows nine markers, printed with the finger, without positions.
"""

import numpy as np

from geometry.arrays import FloatArray
from geometry.finger.parameters import Parameters
from geometry.finger.section import rib_axes


def marker_positions(parameters: Parameters) -> FloatArray:
    """Centres of the markers of the design's layout, ordered from base to tip, shape (m, 2), mm."""
    if parameters.marker_layout == "front":
        return front_markers(parameters)
    return joint_markers(parameters)


def front_markers(parameters: Parameters) -> FloatArray:
    """`marker_count` markers on the front wall's centre line at x = height k / (marker_count + 1)."""
    p = parameters
    x = p.height * np.arange(1, p.marker_count + 1) / (p.marker_count + 1)
    return np.stack([x, np.full_like(x, -p.front_thickness / 2)], axis=1)


def joint_markers(parameters: Parameters) -> FloatArray:
    """A marker where each rib's axis meets either wall's centre line, and one in the tip: 2 rib_count + 1.

    The tip marker lies on the bisector of the apex, half the tip's length from it.
    """
    p = parameters
    half_angle = np.arctan2(p.base_width, p.height) / 2
    tip = np.array([p.height - p.tip_length / 2, -p.tip_length / 2 * np.tan(half_angle)])
    points = np.concatenate([rib_axes(p).reshape(-1, 2), tip[None]])
    return np.asarray(points[np.lexsort((-points[:, 1], points[:, 0]))], dtype=np.float64)

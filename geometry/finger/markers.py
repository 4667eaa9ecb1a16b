"""Markers of a finger: where their centres are."""

from functools import lru_cache

import numpy as np

from pinnray.geometry.finger.parameters import Parameters
from pinnray.geometry.finger.section import rib_axes, tip_middle, tip_tangent
from pinnray.runtime.arrays import FloatArray


@lru_cache(maxsize=64)
def marker_positions(p: Parameters) -> FloatArray:
    """Centres of the markers, ordered from base to tip, shape (m, 2), mm.

    `joints`: where each rib's axis meets either wall's centre line, and one in the middle of the solid tip,
    on the bisector of the apex: 2 rib_count + 1. `front`: `marker_count` of them on the front wall's centre
    line, evenly along the front face.

    The paper shows nine markers, printed with the finger, without positions; its group tracks the eight rib
    ends and the tip in later code (csiro-robotics/Sim2Real_CFM_Soft_robotic).
    """
    if p.marker_layout == "front":
        x = (p.height - tip_tangent(p)) * np.arange(1, p.marker_count + 1) / (p.marker_count + 1)
        points = np.stack([x, np.full_like(x, -p.front_thickness / 2)], axis=1)
    else:
        points = np.concatenate([rib_axes(p).reshape(-1, 2), tip_middle(p)[None]])
        points = points[np.lexsort((-points[:, 1], points[:, 0]))]
    points.setflags(write=False)  # the cache hands out one array
    return np.asarray(points, dtype=np.float64)

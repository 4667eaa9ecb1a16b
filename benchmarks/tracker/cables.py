"""Cables between the camera and the finger."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from pinnray.vision.rig.recording import Recording
from pinnray.vision.rig.shapes import Paint, Shape, closed

CABLES: dict[str, Paint] = {"dark": (0.10, 0.10, 0.11), "light": (0.52, 0.50, 0.50)}
"""Paints of cables: one like dark markers, and one unlike."""
REACH = 75.0
"""Half the length of a cable, mm."""
ANGLE, WIDTH = np.deg2rad(70.0), 4.0
"""Of a cable with the x axis, and across, mm."""


def cable(point: ArrayLike, radius: float, share: float, *, z: float = 1.0, paint: str = "dark") -> Shape:
    """A straight cable that hides a share of the diameter of a disc.

    Args:
        point: Centre of the disc, shape (2,), mm.
        radius: Of the disc, mm.
        share: 0 if the cable touches the disc, 1 if it hides it.
        z: Of the cable's plane, mm.
        paint: One of `CABLES`.
    """
    along = np.array([np.cos(ANGLE), np.sin(ANGLE)])
    across = np.array([along[1], -along[0]])
    near = np.asarray(point) + radius * (1 - 2 * share) * across
    far = near + WIDTH * across
    ends = [near - REACH * along, far - REACH * along, far + REACH * along, near + REACH * along]
    return Shape(closed(ends), CABLES[paint], z)


def covered(
    shares: Mapping[int, float], paint: str = "dark"
) -> Callable[[Recording], Callable[[int], Sequence[Shape]]]:
    """Cables over shares of the diameters of markers, which are counted from 1, in all frames."""

    def hide(film: Recording) -> Callable[[int], Sequence[Shape]]:
        radius, z = film.bench.finger.marker_radius, film.bench.workspace.marker_plane

        def cables(frame: int) -> list[Shape]:
            load = float(film.motion.load(frame + film.motion.shutter / 2))
            centres = film.bench.markers(load * film.displacement)[:, :2]
            return [cable(centres[n - 1], radius, share, z=z, paint=paint) for n, share in shares.items()]

        return cables

    return hide

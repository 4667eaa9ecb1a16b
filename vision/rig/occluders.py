"""Cables between the camera and the finger."""

from collections.abc import Callable, Mapping, Sequence
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from pinnray.runtime.errors import UserError
from pinnray.vision.calibration.camera import Camera, Pose
from pinnray.vision.rig.bench import Bench
from pinnray.vision.rig.motion import Course, Motion
from pinnray.vision.rig.render import pixel_coverage
from pinnray.vision.rig.shapes import Paint, Shape, area, closed, seen_edges

CABLES: dict[str, Paint] = {"dark": (0.10, 0.10, 0.11), "light": (0.52, 0.50, 0.50)}
"""Paints of cables: one like dark markers, and one unlike."""
REACH = 75.0
"""Half the length of a cable, mm."""


def cable(
    point: ArrayLike,
    radius: float,
    share: float,
    *,
    angle: float = 70.0,
    width: float = 4.0,
    z: float = 1.0,
    paint: str = "dark",
) -> Shape:
    """A straight cable that hides a share of the diameter of a disc.

    Args:
        point: Centre of the disc, shape (2,), mm.
        radius: Of the disc, mm.
        share: 0 if the cable touches the disc, 1 if it hides it.
        angle: Of the cable with the x axis, degrees.
        width: Of the cable, mm.
        z: Of the cable's plane, mm.
        paint: One of `CABLES`.
    """
    along = np.array([np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))])
    across = np.array([along[1], -along[0]])
    near = np.asarray(point) + radius * (1 - 2 * share) * across
    far = near + width * across
    ends = [near - REACH * along, far - REACH * along, far + REACH * along, near + REACH * along]
    return Shape(closed(ends), CABLES[paint], z)


def check_covers(shares: Mapping[int, float], count: int) -> None:
    """Refuse shares of markers to cover.

    Args:
        shares: Share of the diameter that is covered, by the numbers of the markers.
        count: Number of markers.

    Raises:
        UserError: If there is no such marker, or a share is not between 0 and 1.
    """
    for number, share in shares.items():
        if not 1 <= number <= count:
            raise UserError(f"there is no marker {number} to cover; there are 1 to {count}")
        if not 0 <= share <= 1:
            raise UserError(f"marker {number} cannot be covered by {share:g} of its diameter; give 0 to 1")


def cables(
    bench: Bench,
    course: Course,
    motion: Motion,
    shares: Mapping[int, float],
    during: str = "all",
    *,
    paint: str = "dark",
) -> Callable[[int], Sequence[Shape]]:
    """Cables that follow markers and hide shares of their diameters during a part of a recording.

    Args:
        bench: With the markers, from 1 on.
        course: Displacements of the finger.
        motion: Whose frames they are.
        shares: By the number of the marker.
        during: One of `motion.parts`.
        paint: One of `CABLES`.

    Returns:
        The occluders in a frame.

    Raises:
        UserError: If there is no such marker, or a share is not between 0 and 1.
    """
    check_covers(shares, len(bench.mesh.marker_nodes))

    @cache
    def at(load: float) -> tuple[Shape, ...]:
        centres = bench.markers(course.at(load))
        radius = bench.finger.marker_radius
        return tuple(
            cable(centres[number - 1, :2], radius, share, z=bench.workspace.marker_plane, paint=paint)
            for number, share in shares.items()
        )

    def occluders(frame: int) -> tuple[Shape, ...]:
        return at(float(motion.load(frame + motion.shutter / 2))) if frame in motion.parts[during] else ()

    return occluders


def share_seen(shape: Shape, occluders: Sequence[Shape], camera: Camera, pose: Pose) -> float:
    """Share of a shape's image that is visible: inside the frame and not occluded, to a hundredth."""
    size = (camera.width, camera.height)
    edges = seen_edges(shape, camera, pose) + 0.5
    whole = abs(area(edges))
    rows, columns, left = pixel_coverage(edges, size)
    for occluder in occluders:
        hidden = np.zeros_like(left)
        beside = seen_edges(occluder, camera, pose) + 0.5 - (columns.start, rows.start)
        where = pixel_coverage(beside, (hidden.shape[1], hidden.shape[0]))
        hidden[where.rows, where.columns] = where.share
        left = left * (1 - hidden)
    return float(left.sum() / whole)

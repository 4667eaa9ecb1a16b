"""A camera that was moved between start and end: the fiducials, which stay where they are, undo it."""

from typing import NamedTuple

import numpy as np

from geometry.errors import UserError
from vision.discs.disc_detector import DiscDetections
from vision.tracking.marker_plane import MarkerPlane
from vision.tracking.scene import FilmedScene, FoundFiducials

FEWEST = 4
"""Fiducials from which a camera's place is known."""
STEADY = 2.0
"""Way of the fiducials that counts as none, in standard deviations of a coordinate's way."""
UNKNOWNS = 6
"""Of a camera's place, which the fiducials' coordinates have to tell."""


class CameraMotion(NamedTuple):
    """What the fiducials did between start and end.

    Attributes:
        way: Median over the fiducials, pixels; nan if none was seen at both ends.
        planes: Of the markers at start and end; None if the camera stood still or too few fiducials tell.
        deviation: Standard deviation of a coordinate that the planes undo, pixels.
    """

    shift: float
    planes: tuple[MarkerPlane, MarkerPlane] | None
    deviation: float = 0.0

    def undone(self, final: DiscDetections) -> DiscDetections:
        """Discs at the end where the camera would have seen them had it stayed where it was."""
        if self.planes is None:
            return final
        start, end = self.planes
        centres, known = final.centres.copy(), np.isfinite(final.radii)
        centres[known] = start.pixels(end.points(centres[known]))
        return final._replace(centres=centres, covariances=final.covariances + self.deviation**2 * np.eye(2))


def find_camera_motion(scene: FilmedScene, before: DiscDetections, after: DiscDetections) -> CameraMotion:
    """How the camera moved, from the fiducials at rest at start and end, nan where one was not seen.

    Raises:
        UserError: If no fiducial is where it was.
    """
    common = np.isfinite(before.radii + after.radii)
    if not common.any():
        raise UserError(
            "no fiducial is seen in the end where it was at the start: the camera was moved, or they are "
            "hidden; fix the camera, and show them at both ends"
        )
    shift = float(np.median(np.linalg.norm(after.centres - before.centres, axis=1)[common]))
    variances = np.diagonal(before.covariances + after.covariances, axis1=1, axis2=2)[common]
    noise, count = float(np.sqrt(np.median(variances))), int(common.sum())
    if shift < STEADY * noise or count < FEWEST:
        return CameraMotion(shift, None)
    numbers = np.nonzero(common)[0]
    # Equal weights let what the lens does to the fiducials cancel, also where it is not known.
    alike = after._replace(covariances=before.covariances)
    start, end = (
        scene.plane(FoundFiducials(numbers, detections.where(common))) for detections in (before, alike)
    )
    return CameraMotion(shift, (start, end), noise * np.sqrt(UNKNOWNS / (2 * count)))

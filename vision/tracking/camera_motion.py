"""Motion of the camera between start and end, from the fiducials, and its correction."""

from typing import NamedTuple

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.discs.disc_detector import DiscDetections
from pinnray.vision.tracking.marker_plane import MarkerPlane
from pinnray.vision.tracking.plane_fit import pose_covariance
from pinnray.vision.tracking.scene import FilmedScene

FEWEST = 4
"""Number of fiducials that determines the pose of a camera."""
STEADY = 2.0
"""Fiducial shift, in standard deviations, below which the camera counts as static."""
UNKNOWNS = 6
"""Parameters of a pose."""


class CameraMotion(NamedTuple):
    """Motion of the camera between start and end.

    Attributes:
        shift: Median over the fiducials, pixels.
        planes: Of the markers at start and end; None if the camera is static, or the fiducials are too few or
            in a row.
        deviation: Standard deviation of a coordinate that is corrected by planes without a camera, pixels.
        poses: Covariances of the camera's poses at both ends, by the fiducials' noise; none without a camera.
    """

    shift: float
    planes: tuple[MarkerPlane, MarkerPlane] | None
    deviation: float = 0.0
    poses: tuple[FloatArray, ...] = ()

    def undone(self, final: DiscDetections) -> DiscDetections:
        """Discs at the end, mapped to where a static camera would have seen them."""
        if self.planes is None:
            return final
        start, end = self.planes
        centres, known = final.centres.copy(), np.isfinite(final.radii)
        points = end.points(centres[known])
        centres[known] = start.pixels(points)
        covariances = final.covariances + (0.0 if self.poses else self.deviation**2) * np.eye(2)
        for plane, pose in zip(self.planes, self.poses, strict=False):
            # At another height than the fiducials' a wrong tilt moves the markers farther.
            by_pose = plane.projection.jacobians(points, plane.parameters).parameters[:, :, :6]
            covariances[known] += by_pose @ pose @ by_pose.transpose(0, 2, 1)
        return final._replace(centres=centres, covariances=covariances)


def find_camera_motion(scene: FilmedScene, before: DiscDetections, after: DiscDetections) -> CameraMotion:
    """Estimate the motion from the fiducials at rest, shape (f, ...), at start and end; nan for hidden ones.

    Raises:
        UserError: If no fiducial was detected at both ends.
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
    numbers = np.where(common, np.arange(len(common)), -1)
    # Equal weights make the distortion of the lens cancel, also where it is not known.
    alike = after._replace(covariances=before.covariances)
    try:
        start, end = (scene.plane(fiducials.numbered(numbers)) for fiducials in (before, alike))
    except UserError:  # those that both ends show lie in a row
        return CameraMotion(shift, None)
    points = scene.workspace.points[common]
    poses = [
        pose_covariance(plane, points, fiducials.covariances[common])
        for plane, fiducials in ((start, before), (end, after))
    ]
    known = tuple(pose for pose in poses if pose is not None)
    return CameraMotion(shift, (start, end), noise * np.sqrt(UNKNOWNS / (2 * count)), known)

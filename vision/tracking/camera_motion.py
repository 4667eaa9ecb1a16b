"""Motion of the camera between start and end, from the fiducials, and its correction."""

from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

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
MANY = 6
"""Fiducials whose misfit shows what a zoom leaves; fewer follow the lens by another pose."""
UNKNOWNS = 6
"""Parameters of a pose."""
EXCESS = 0.05
"""Probability with which noise leaves more of the fiducials' motion than counts as noise."""


class CameraMotion(NamedTuple):
    """Motion of the camera between start and end.

    Attributes:
        shift: Median over the fiducials, pixels.
        planes: Of the markers at start and end; None if the camera is static, or the fiducials are too few or
            in a row.
        deviation: Standard deviation of a coordinate that is corrected by planes without a camera, pixels.
        poses: Covariances of the camera's poses at both ends, by the fiducials' noise; none without a camera.
        enlargement: Scale of the picture at the end over that at the start, less one.
        remains: Root mean square of what the planes leave of the fiducials' motion, beyond noise, pixels: a
            lens whose zoom or focus changed is not undone by another pose. Without planes all of it.
    """

    shift: float
    planes: tuple[MarkerPlane, MarkerPlane] | None
    deviation: float = 0.0
    poses: tuple[FloatArray, ...] = ()
    enlargement: float = 0.0
    remains: float = 0.0

    def undone(self, final: DiscDetections) -> DiscDetections:
        """Discs at the end, mapped to where a static camera would have seen them."""
        if self.planes is None:
            return final._replace(covariances=final.covariances + self.remains**2 * np.eye(2))
        start, end = self.planes
        centres, known = final.centres.copy(), np.isfinite(final.radii)
        points = end.points(centres[known])
        centres[known] = start.pixels(points)
        by_planes = 0.0 if self.poses else self.deviation**2
        covariances = final.covariances + (by_planes + self.remains**2) * np.eye(2)
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
    if shift < STEADY * noise:
        return CameraMotion(shift, None)
    if count < FEWEST:
        return CameraMotion(shift, None, remains=shift)
    numbers = np.where(common, np.arange(len(common)), -1)
    # Equal weights make the distortion of the lens cancel, also where it is not known.
    alike = after._replace(covariances=before.covariances)
    try:
        start, end = (scene.plane(fiducials.numbered(numbers)) for fiducials in (before, alike))
    except UserError:  # those that both ends show lie in a row
        return CameraMotion(shift, None, remains=shift)
    points, radius = scene.workspace.points[common], scene.workspace.fiducial_diameter / 2
    ends = ((start, before), (end, after))
    poses = [pose_covariance(plane, points, seen.covariances[common]) for plane, seen in ends]
    known = tuple(pose for pose in poses if pose is not None)
    deviation = noise * np.sqrt(UNKNOWNS / (2 * count))
    larger = float((end.scales(points) / start.scales(points)).mean()) - 1
    away = [plane.on_sheet.circles(seen.centres[common], radius) for plane, seen in ends]
    left = (away[1] - away[0]) * end.scales(points)[:, None]
    freedom = 2 * count - (UNKNOWNS if known else len(end.parameters))
    squares = float((left**2 / variances).sum())
    chance = freedom < 1 or squares < chdtri(freedom, EXCESS)
    remains = 0.0 if chance else noise * np.sqrt(squares / freedom - 1)
    if count < MANY and scene.camera is not None:  # a cubic correction is wrong by twice the zoom's share
        lens = scene.camera.undistort(before.centres[common]) - before.centres[common]
        remains = max(remains, 2 * abs(larger) * float(np.sqrt((lens**2).mean())))
    return CameraMotion(shift, (start, end), deviation, known, larger, remains)

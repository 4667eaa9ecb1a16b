"""First guesses for the bundle adjustment: board poses for a known camera, and a camera from its views.

The camera has no distortion and its principal point in the middle of the image; its focal length is the best
of a geometric series. Units: mm, pixels.
"""

from dataclasses import fields

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from geometry.errors import UserError
from vision.calibration.bundle_adjustment import CornerObservations, Poses
from vision.calibration.camera import Camera
from vision.calibration.lens import LENSES

FOCAL_LENGTHS = 2.0 ** np.arange(-2.5, 4.5, 0.5)
"""In widths of the image: angles of view from 140 to 4 degrees (fisheye: beyond)."""


def initial_camera(observations: CornerObservations, size: tuple[int, int], model: str) -> Camera:
    """First guess of the camera.

    Args:
        observations: Corners of the board.
        size: (width, height) of the images, pixels.
        model: Name of the lens.

    Raises:
        UserError: If the poses cannot be found for any focal length.
    """
    best, least = None, np.inf
    for focal in (size[0] * FOCAL_LENGTHS).tolist():
        distortion = (0.0,) * len(fields(LENSES[model]))
        centre = (0.5 * (size[0] - 1), 0.5 * (size[1] - 1))
        camera = Camera(*size, focal, focal, *centre, distortion, model)
        try:
            placed = initial_poses(camera, observations).to_camera(observations.points, observations.view)
            cost = float(np.sum((camera.project(placed) - observations.pixels) ** 2))
        except UserError:
            continue
        if cost < least:
            best, least = camera, cost
    if best is None:
        raise UserError("no camera sees a board as it stands in the photographs")
    return best


def initial_poses(camera: Camera, observations: CornerObservations) -> Poses:
    """First guess of the board's pose in every view.

    Source: T. Collins, A. Bartoli, "Infinitesimal plane-based pose estimation", IJCV 109, 2014, as in OpenCV.

    Raises:
        UserError: If the corners of a view are no image of a plane, or the distortion cannot be undone there.
    """
    straight = camera.undistort(observations.pixels)
    points, pixels = (np.split(each, observations.starts[1:]) for each in (observations.points, straight))
    poses = []
    for corners, seen in zip(points, pixels, strict=True):
        try:
            found, *pose = cv2.solvePnP(corners, seen, camera.matrix, np.zeros(4), flags=cv2.SOLVEPNP_IPPE)
        except cv2.error:
            found = False
        if not found or not np.isfinite(pose).all():
            raise UserError("the corners of a view are no image of a plane")
        poses.append(np.ravel(pose))
    rotations, translations = np.split(np.array(poses, dtype=np.float64), 2, axis=1)
    return Poses(Rotation.from_rotvec(rotations), translations)

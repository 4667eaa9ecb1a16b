"""Where an adjustment starts: poses of a board for a known camera, and a camera from nothing.

The camera is one without distortion and with its axis in the middle of the image, of that focal length in a
geometric series that explains the views best. Units: mm, pixels.
"""

from dataclasses import fields

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from geometry.arrays import FloatArray
from geometry.errors import UserError
from vision.calibration.bundle_adjustment import CornerObservations, Poses
from vision.calibration.camera import Camera
from vision.calibration.lens import LENSES

FOCAL_LENGTHS = 2.0 ** np.arange(-2.5, 4.5, 0.5)
"""In widths of the image: angles of view from 140 to 4 degrees (fisheye: beyond)."""


def initial_camera(observations: CornerObservations, size: tuple[int, int], model: str) -> Camera:
    """A camera near the one that saw a board.

    Args:
        observations: What was seen.
        size: (width, height) of the images, pixels.
        model: Name of the lens.

    Raises:
        UserError: If no focal length explains what was seen.
    """
    best, least = None, np.inf
    for focal in (size[0] * FOCAL_LENGTHS).tolist():
        distortion = (0.0,) * len(fields(LENSES[model]))
        centre = (0.5 * (size[0] - 1), 0.5 * (size[1] - 1))
        camera = Camera(*size, focal, focal, *centre, distortion, model)
        try:
            placed = initial_poses(camera, observations).place(observations.points, observations.view)
            cost = float(np.sum((camera.project(placed) - observations.pixels) ** 2))
        except UserError:
            continue
        if cost < least:
            best, least = camera, cost
    if best is None:
        raise UserError("no camera sees a board as it stands in the photographs")
    return best


def initial_poses(camera: Camera, observations: CornerObservations) -> Poses:
    """Where the board was in every view.

    Source: T. Collins, A. Bartoli, "Infinitesimal plane-based pose estimation", IJCV 109, 2014, as in OpenCV.

    Raises:
        UserError: If the corners of a view are no image of a plane, or the distortion cannot be undone there.
    """
    straight = camera.undistort(observations.pixels)
    rotations, translations = [], []
    views = zip(_split(observations.points, observations), _split(straight, observations), strict=True)
    for points, pixels in views:
        try:
            found, rotation, shift = cv2.solvePnP(
                points, pixels, camera.matrix, np.zeros(4), flags=cv2.SOLVEPNP_IPPE
            )
        except cv2.error:
            found = False
        if not found or not np.isfinite([*rotation, *shift]).all():
            raise UserError("the corners of a view are no image of a plane")
        rotations.append(np.ravel(rotation))
        translations.append(np.ravel(shift))
    return Poses(Rotation.from_rotvec(rotations), np.array(translations))


def _split(values: FloatArray, observations: CornerObservations) -> list[FloatArray]:
    return np.split(values, observations.starts[1:])

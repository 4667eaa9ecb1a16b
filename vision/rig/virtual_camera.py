"""The virtual camera and its pose."""

import cv2
import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.vision.calibration.camera import Camera, Pose
from pinnray.vision.tracking.workspace import Workspace

RIM = 0.06
"""Margin around the fiducials, as a share of the image."""


def default_camera(width: int = 1280, height: int = 720) -> Camera:
    """A camera with slight barrel distortion; without a covariance."""
    focus = 1.02 * width
    distortion = (-0.1, 0.02, 5e-4, -3e-4, 0.0)
    return Camera(width, height, focus, focus, 0.507 * width, 0.491 * height, distortion)


def viewing_pose(
    camera: Camera, workspace: Workspace, *, tilt: float = 0.0, direction: float = 60.0, turn: float = 0.0
) -> Pose:
    """Pose of the workspace in front of a camera that is aimed at its middle and sees all fiducials.

    Args:
        camera: The camera.
        workspace: Its z axis points towards the camera.
        tilt: Angle between the optical axis and the workspace's z axis, degrees.
        direction: Of the axis about which it is tilted, in the image, degrees from right to down.
        turn: About the optical axis, degrees.
    """
    places = np.column_stack([workspace.points, np.zeros(len(workspace.points))])
    middle = (places.min(axis=0) + places.max(axis=0)) / 2
    turned = _rotation([0, 0, np.deg2rad(turn)])
    facing = np.diag([1.0, -1.0, -1.0])
    reach = np.abs((places - middle) @ (turned @ facing).T).max(axis=0) + workspace.fiducial_diameter / 2
    span = 2 * reach / (1 - 2 * RIM)
    distance = max(camera.fx * span[0] / camera.width, camera.fy * span[1] / camera.height)
    axis = np.deg2rad(direction)
    tilted = _rotation(np.deg2rad(tilt) * np.array([np.cos(axis), np.sin(axis), 0]))
    rotation = turned @ tilted @ facing
    # Aim at the middle of the image, which differs from the principal point.
    aim = np.linalg.solve(camera.matrix, [(camera.width - 1) / 2, (camera.height - 1) / 2, 1.0])
    return Pose(cv2.Rodrigues(rotation)[0].ravel(), distance * aim - rotation @ middle)


def _rotation(vector: FloatArray | list[float]) -> FloatArray:
    return np.asarray(cv2.Rodrigues(np.array(vector, dtype=np.float64))[0], dtype=np.float64)

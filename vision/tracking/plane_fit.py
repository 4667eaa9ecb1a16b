"""The markers' plane from fiducials: weighted least squares of what it is seen through."""

from contextlib import suppress

import cv2
import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from vision.calibration.camera import Camera
from vision.tracking.marker_plane import (
    CameraProjection,
    HomographyProjection,
    MarkerPlane,
    PlaneProjection,
    SimilarityProjection,
)

STEPS = 50
CONVERGED = 1e-9
"""Relative length of the last step."""
UNDETERMINED = "the fiducials do not determine where the camera is"


def camera_plane(
    camera: Camera,
    points: FloatArray,
    pixels: FloatArray,
    covariances: FloatArray,
    *,
    height: float = 0.0,
) -> MarkerPlane:
    """The plane z = `height` from fiducials in the plane z = 0, seen by a calibrated camera.

    Args:
        camera: With covariance, if its errors are to count.
        points: Fiducials, shape (n, 2), mm.
        pixels: Where they are seen, shape (n, 2), pixels.
        covariances: Of the pixels, shape (n, 2, 2), pixels².
        height: Of the plane, mm.
    """
    rays = camera.undistort(pixels)
    flat = np.column_stack([points, np.zeros(len(points))])
    _, rotations, translations, _ = cv2.solvePnPGeneric(
        flat, rays, camera.matrix, np.zeros(5), flags=cv2.SOLVEPNP_IPPE
    )
    projection = CameraProjection(camera)
    fits = []
    for start in zip(rotations, translations, strict=True):
        with suppress(UserError):  # behind the camera
            fits.append(_refined(projection, np.ravel(start), points, pixels, covariances))
    if not fits:
        raise UserError(f"{UNDETERMINED}; give the design or workspace, and the camera, of the video")
    # A plane that is seen obliquely looks almost like another one; the better of both is kept.
    pose, squares = min(fits, key=lambda fit: fit[1])
    jacobians = projection.jacobians(points, pose).parameters.reshape(2 * len(points), -1)
    gain, inverse = _gain(jacobians[:, :6], covariances)
    # A wrong lens is partly made up for by the pose that is fitted through it.
    follow = np.concatenate([-gain @ jacobians[:, 6:], np.eye(jacobians.shape[1] - 6)])
    covariance = follow @ (camera.covariance or np.zeros((len(camera.intrinsic_names),) * 2)) @ follow.T
    covariance[:6, :6] += inverse * max(1.0, squares / (2 * len(points) - 6))
    residual = _rms(projection.points(pixels, pose) - points)
    return MarkerPlane(
        CameraProjection(camera, height), np.append(pose, camera.intrinsics), covariance, residual
    )


def homography_plane(points: FloatArray, pixels: FloatArray, covariances: FloatArray) -> MarkerPlane:
    """The plane of the fiducials without a camera; arguments as of `camera_plane`."""
    start = cv2.findHomography(points, pixels, 0)[0]
    return _flat_plane(HomographyProjection(), (start / start[2, 2]).ravel()[:8], points, pixels, covariances)


def similarity_plane(points: FloatArray, pixels: FloatArray, covariances: FloatArray) -> MarkerPlane:
    """The plane whose scale, turn and shift put points at pixels; arguments as of `camera_plane`."""
    return _flat_plane(SimilarityProjection(), np.array([1.0, 0.0, 0.0, 0.0]), points, pixels, covariances)


def _flat_plane(
    projection: PlaneProjection,
    start: FloatArray,
    points: FloatArray,
    pixels: FloatArray,
    covariances: FloatArray,
) -> MarkerPlane:
    """The fit of a view that knows no lens; what that leaves is no noise, so it does not shrink in a mean."""
    parameters, squares = _refined(projection, start, points, pixels, covariances)
    jacobians = projection.jacobians(points, parameters).parameters.reshape(2 * len(points), -1)
    excess = max(0.0, squares / max(2 * len(points) - len(parameters), 1) - 1)
    residual = _rms(projection.points(pixels, parameters) - points)
    return MarkerPlane(
        projection, parameters, _gain(jacobians, covariances)[1] * (1 + len(points) * excess), residual
    )


def _refined(
    projection: PlaneProjection,
    parameters: FloatArray,
    points: FloatArray,
    pixels: FloatArray,
    covariances: FloatArray,
) -> tuple[FloatArray, float]:
    """Least squares by Gauss and Newton: the parameters and the sum of weighted squares."""
    known = np.linalg.inv(np.linalg.cholesky(covariances))
    count = len(parameters)
    for _ in range(STEPS):
        missed = (known @ (pixels - projection.pixels(points, parameters))[:, :, None]).ravel()
        jacobians = (known @ projection.jacobians(points, parameters).parameters[:, :, :count]).reshape(
            -1, count
        )
        scale = np.linalg.norm(jacobians, axis=0)
        step = np.linalg.lstsq(jacobians / scale, missed, rcond=None)[0] / scale
        parameters = parameters + step
        if np.abs(step * scale).max() < CONVERGED * (1 + np.abs(parameters * scale).max()):
            return parameters, float(missed @ missed)
    raise UserError(f"{UNDETERMINED}; spread them around the finger")


def _gain(jacobians: FloatArray, covariances: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How parameters follow measurements in weighted least squares, and the parameters' covariance."""
    blocks = jacobians.reshape(-1, 2, jacobians.shape[1])
    weighted = np.linalg.solve(covariances, blocks).reshape(jacobians.shape)
    inverse = np.linalg.inv(jacobians.T @ weighted)
    return inverse @ weighted.T, inverse


def _rms(missed: FloatArray) -> float:
    return float(np.sqrt((missed**2).sum(axis=1).mean()))

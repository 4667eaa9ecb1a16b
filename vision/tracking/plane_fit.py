"""Weighted least-squares fits of the markers' plane to fiducials."""

from contextlib import suppress
from dataclasses import replace

import cv2
import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.calibration.camera import Camera
from pinnray.vision.tracking.marker_plane import (
    HOMOGRAPHY,
    SIMILARITY,
    CameraProjection,
    MarkerPlane,
    PlaneProjection,
)

STEPS = 50
CONVERGED = 1e-9
"""Relative length of the last step."""
BENDING = 5.0
"""Mean square derivative of the second Legendre polynomial over its mean square, times that of x."""
UNDETERMINED = "the fiducials do not determine where the camera is"


def camera_plane(
    camera: Camera, points: FloatArray, pixels: FloatArray, covariances: FloatArray, *, height: float = 0.0
) -> MarkerPlane:
    """Fit the plane z = `height` to fiducials in the plane z = 0, with a calibrated camera.

    Args:
        camera: With a covariance to propagate, or none.
        points: Fiducials, shape (n, 2), mm.
        pixels: The same in the image, shape (n, 2), pixels.
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
    # An oblique plane has two similar poses; keep the better one.
    pose, squares = min(fits, key=lambda fit: fit[1])
    if (angle := np.linalg.norm(pose[:3])) > np.pi:  # the same rotation the other way round
        pose = np.append(pose[:3] * (1 - 2 * np.pi / angle), pose[3:])
    jacobians = projection.jacobians(points, pose).parameters.reshape(2 * len(points), -1)
    gain, inverse = _gain(jacobians[:, :6], covariances)
    # The fitted pose compensates errors of the intrinsics in part.
    follow = np.concatenate([-gain @ jacobians[:, 6:], np.eye(jacobians.shape[1] - 6)])
    covariance = follow @ (camera.covariance or np.zeros((len(camera.intrinsics),) * 2)) @ follow.T
    covariance[:6, :6] += inverse * max(1.0, squares / (2 * len(points) - 6))
    residual = _rms(projection.points(pixels, pose) - points)
    parameters = np.append(pose, camera.intrinsics)
    return MarkerPlane(CameraProjection(camera, height), parameters, covariance, residual)


def pose_covariance(plane: MarkerPlane, points: FloatArray, covariances: FloatArray) -> FloatArray | None:
    """Covariance of a camera's pose by the noise of the fiducials, shape (6, 6); None without a camera.

    Arguments as of `camera_plane`.
    """
    if not isinstance(plane.projection, CameraProjection):
        return None
    on_sheet = CameraProjection(plane.projection.camera).jacobians(points, plane.parameters)
    return _gain(on_sheet.parameters[:, :, :6].reshape(2 * len(points), 6), covariances)[1]


def homography_plane(points: FloatArray, pixels: FloatArray, covariances: FloatArray) -> MarkerPlane:
    """Fit a homography, without a camera; arguments as of `camera_plane`."""
    start = cv2.findHomography(points, pixels, 0)[0]  # its last entry is 1
    if start is None:
        raise UserError(f"{UNDETERMINED}; spread them around the finger")
    entries = np.ravel(start).astype(np.float64)[:8]
    return _plane_without_lens(HOMOGRAPHY, entries, points, pixels, covariances)


def similarity_plane(points: FloatArray, pixels: FloatArray, covariances: FloatArray) -> MarkerPlane:
    """Fit a scale, rotation and shift; arguments as of `camera_plane`."""
    # The pixels are linear in a similarity: from any start the first step leads to its end.
    return _plane_without_lens(SIMILARITY, np.zeros(4), points, pixels, covariances)


def plane_of_markers(points: FloatArray, pixels: FloatArray, covariances: FloatArray) -> MarkerPlane:
    """Fit a similarity to the markers themselves; arguments as of `camera_plane`.

    What lens and tilt leave of the fit is at least quadratic along the markers, a second Legendre polynomial,
    whose derivative is √5 times its root mean square over that of the places: a marker that moves goes astray
    by as much of its way, as the fit at rest alone does not show.
    """
    plane = similarity_plane(points, pixels, covariances)
    noise = np.trace(covariances, axis1=1, axis2=2) / plane.scales(points) ** 2
    misfit = max(plane.residual**2 - float(noise.mean()), 0.0) / 2  # of a coordinate
    places = float(((points - points.mean(axis=0)) ** 2).sum(axis=1).mean())
    return replace(plane, bending=(BENDING * misfit / places) ** 0.5)


def _plane_without_lens(
    projection: PlaneProjection, start: FloatArray, points: FloatArray, *measured: FloatArray
) -> MarkerPlane:
    """Fit a projection without a lens; the misfit is no noise, which a mean over fiducials would reduce."""
    parameters, squares = _refined(projection, start, points, *measured)
    jacobians = projection.jacobians(points, parameters).parameters.reshape(2 * len(points), -1)
    excess = max(0.0, squares / max(2 * len(points) - len(parameters), 1) - 1)
    pixels, covariances = measured
    covariance = _gain(jacobians, covariances)[1] * (1 + len(points) * excess)
    residual = _rms(projection.points(pixels, parameters) - points)
    return MarkerPlane(projection, parameters, covariance, residual)


def _refined(
    projection: PlaneProjection, parameters: FloatArray, points: FloatArray, *measured: FloatArray
) -> tuple[FloatArray, float]:
    """Gauss-Newton least squares: the parameters and the sum of weighted squares."""
    pixels, covariances = measured
    known = np.linalg.inv(np.linalg.cholesky(covariances))
    count = len(parameters)
    for _ in range(STEPS):
        missed = (known @ (pixels - projection.pixels(points, parameters))[:, :, None]).ravel()
        by_parameters = projection.jacobians(points, parameters).parameters[:, :, :count]
        jacobians = (known @ by_parameters).reshape(-1, count)
        scale = np.linalg.norm(jacobians, axis=0)
        step = np.linalg.lstsq(jacobians / scale, missed, rcond=None)[0] / scale
        parameters = parameters + step
        if np.abs(step * scale).max() < CONVERGED * (1 + np.abs(parameters * scale).max()):
            return parameters, float(missed @ missed)
    raise UserError(f"{UNDETERMINED}; spread them around the finger")


def _gain(jacobians: FloatArray, covariances: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Derivatives of the fitted parameters by the measurements, and the parameters' covariance."""
    blocks = jacobians.reshape(-1, 2, jacobians.shape[1])
    weighted = np.linalg.solve(covariances, blocks).reshape(jacobians.shape)
    inverse = np.linalg.inv(jacobians.T @ weighted)
    return inverse @ weighted.T, inverse


def _rms(missed: FloatArray) -> float:
    return float(np.sqrt((missed**2).sum(axis=1).mean()))

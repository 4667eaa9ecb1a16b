"""Fit of a camera to views of a board by OpenCV, its covariance, and its error in other views.

A view is the corners in one photograph, in the order of the board, shape (n, 2), pixels, NaN where one is not
seen. Units: mm, pixels.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.calibration.camera import Camera, Pose
from pinnray.vision.calibration.chessboard import Board

FEWEST_JACKKNIFED = 10
"""Number of views from which on their scatter counts for the covariance."""
STOP = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-12)
"""Most steps of OpenCV's fit, and the relative change that ends it."""
KNOWN_WITHIN = 0.05
"""Relative standard deviation of the focal lengths beyond which views do not determine a camera."""
UNDETERMINED = (
    "the photographs do not determine the camera; take some with the board tilted by 20 to 45 degrees in "
    "different directions"
)


class CameraFit(NamedTuple):
    """A fitted camera.

    Attributes:
        camera: With the covariance of its intrinsics. Corners count as independent, unless the jackknife over
            views gives a larger standard deviation.
        residuals: Observed minus predicted, shape (views, n, 2), pixels; NaN where a corner was not seen.
    """

    camera: Camera
    residuals: FloatArray


def fit_camera(
    views: Sequence[FloatArray], board: Board, size: tuple[int, int], *, k3: bool, start: Camera | None = None
) -> CameraFit:
    """Fit intrinsics and the board's poses together to views in images of `size`, (width, height).

    Args:
        views: Each determines the pose of the board.
        board: In the views.
        size: Of the images, pixels.
        k3: Whether to fit the third radial coefficient; else it is 0.
        start: First guess; by the vanishing points of the board if None.

    Raises:
        UserError: If the views do not determine the camera.
    """
    seen = [np.isfinite(view[:, 0]) for view in views]
    flags = (0 if k3 else cv2.CALIB_FIX_K3) | (0 if start is None else cv2.CALIB_USE_INTRINSIC_GUESS)
    first = Camera(*size, 1.0, 1.0, 0.0, 0.0) if start is None else start
    places = [board.corners[each].astype(np.float32) for each in seen]
    pixels = [view[each].astype(np.float32) for view, each in zip(views, seen, strict=True)]
    guess = (first.matrix, np.array(first.distortion))
    try:
        _, matrix, distortion, rotations, shifts = cv2.calibrateCamera(
            places, pixels, size, *guess, flags=flags, criteria=STOP
        )
        values = [*np.asarray(matrix)[[0, 1, 0, 1], [0, 1, 2, 2]], *np.ravel(distortion)[:5]]
        camera = first.with_intrinsics(values)
        poses = [Pose(np.ravel(turn), np.ravel(shift)) for turn, shift in zip(rotations, shifts, strict=True)]
        residuals = np.array(views) - [camera.project(board.corners, pose) for pose in poses]
        free = np.arange(len(values)) < len(values) - (not k3)
        covariance = _covariance(camera, poses, residuals, board, free)
    except (cv2.error, UserError, np.linalg.LinAlgError):
        raise UserError(UNDETERMINED) from None
    return CameraFit(replace(camera, covariance=tuple(map(tuple, covariance.tolist()))), residuals)


def held_out_rms(views: Sequence[FloatArray], board: Board, camera: Camera, *, k3: bool) -> float:
    """Root mean square reprojection error, pixels, by 5-fold cross-validation over the views.

    In a view outside the training set, each half of the corners gives the pose that predicts the other half,
    if it determines one.

    Raises:
        UserError: If the views do not determine the camera, or no half determines a pose.
    """
    folds, distances, size = min(5, len(views)), [], (camera.width, camera.height)
    for fold in range(folds):
        others = [view for number, view in enumerate(views) if number % folds != fold]
        known = fit_camera(others, board, size, k3=k3, start=camera).camera
        for view in views[fold::folds]:
            seen = np.isfinite(view[:, 0])
            for half in board.halves:
                if board.determines_pose(half & seen):
                    place, other = board.corners[half & seen], seen & ~half
                    _, turn, shift = cv2.solvePnP(
                        place, view[half & seen], known.matrix, np.array(known.distortion)
                    )
                    pose = Pose(np.ravel(turn), np.ravel(shift))
                    distances.append(known.project(board.corners[other], pose) - view[other])
    if not sum(map(len, distances)):
        raise UserError(
            "no photograph shows enough corners to test the camera with, some eight that are not on a line; "
            "show more of the board"
        )
    return rms(distances)


def rms(distances: Sequence[FloatArray]) -> float:
    """Root mean square length of vectors, shapes (..., 2); NaN does not count."""
    squares = np.concatenate([np.sum(each**2, axis=-1).ravel() for each in distances])
    return float(np.sqrt(np.nanmean(squares)))


def _covariance(
    camera: Camera, poses: Sequence[Pose], residuals: FloatArray, board: Board, free: BoolArray
) -> FloatArray:
    """Covariance of the intrinsics, shape (9, 9), zero for those that are not free.

    With the derivatives J of the pixels of one view by the intrinsics, less their part that its pose can
    make up for, the normal matrix is the sum of JᵀJ over the views (B. Triggs et al., "Bundle adjustment - a
    modern synthesis", Vision Algorithms, 1999, section 6).

    The errors of the corners in one photograph are correlated: by its blur, its light, the bend of the board.
    Leaving out a view changes the intrinsics by their common effect; from `FEWEST_JACKKNIFED` views on the
    variances are at least those of the jackknife over views, to first order (C. F. J. Wu, "Jackknife,
    bootstrap and other resampling methods in regression analysis", Annals of Statistics 14, 1986).

    Raises:
        UserError: If corner errors of 0.1 pixels leave a focal length unknown by more than `KNOWN_WITHIN`.
        LinAlgError: If the corners do not determine the free intrinsics.
    """
    blocks, slopes = [], []
    for pose, missed in zip(poses, residuals, strict=True):
        seen = np.isfinite(missed[:, 0])
        turned = board.corners[seen] @ np.asarray(cv2.Rodrigues(pose.rotation)[0]).T
        projection = camera.project_with_jacobians(turned + pose.translation)
        # of ω x point: point x gradient
        by_turn = np.cross(turned[:, None], projection.by_point)
        by_pose = np.concatenate([by_turn, projection.by_point], axis=2).reshape(-1, 6)
        own = projection.by_intrinsics[:, :, free].reshape(len(by_pose), -1)
        own = own - by_pose @ np.linalg.lstsq(by_pose, own, rcond=None)[0]
        blocks.append(own.T @ own)
        slopes.append(own.T @ missed[seen].ravel())
    normal = np.sum(blocks, axis=0)
    scale = np.sqrt(np.diag(normal))
    freedom = np.isfinite(residuals).sum() - int(free.sum()) - 6 * len(poses)
    variance = float(np.nansum(residuals**2)) / max(int(freedom), 1)
    covariance = np.linalg.inv(normal / np.outer(scale, scale)) / np.outer(scale, scale) * variance
    deviations = np.sqrt(np.diag(covariance))
    if not (deviations[:2] * max(1, 0.1 / rms([residuals])) < KNOWN_WITHIN * camera.intrinsics[:2]).all():
        raise UserError(UNDETERMINED)
    if (count := len(poses)) >= FEWEST_JACKKNIFED:
        kept = (normal - np.array(blocks)) / np.outer(scale, scale)
        steps = np.linalg.solve(kept, (np.array(slopes) / scale)[:, :, None])[:, :, 0] / scale
        larger = np.maximum(np.sqrt((count - 1) / count * (steps**2).sum(axis=0)) / deviations, 1.0)
        covariance = covariance * np.outer(larger, larger)
    whole = np.zeros((len(free), len(free)))
    whole[np.ix_(free, free)] = (covariance + covariance.T) / 2
    return whole

"""Fit of camera and lens to views of a board, from first guesses on, and its error in other views.

Units: mm, pixels.
"""

from collections.abc import Sequence
from dataclasses import fields
from typing import NamedTuple

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from geometry.arrays import FloatArray
from geometry.errors import UserError
from vision.calibration.board_views import corner_observations
from vision.calibration.bundle_adjustment import Adjustment, CornerObservations, Poses, adjust
from vision.calibration.camera import Camera
from vision.calibration.chessboard import Board
from vision.calibration.lens import LENSES

FOLDS = 5
FOCAL_LENGTHS = 2.0 ** np.arange(-2.5, 4.5, 0.5)
"""First guesses, in widths of the image: angles of view from 140 to 4 degrees (fisheye: beyond)."""
CORNER_ERROR, LARGEST_DEVIATION = 0.1, 0.05
"""Pixels; largest relative standard deviation of the focal lengths for corner errors of that size."""
UNDETERMINED = (
    "the photographs do not determine the camera; take some with the board tilted by 20 to 45 degrees in "
    "different directions"
)


class LensChoice(NamedTuple):
    """Lens model to fit.

    Attributes:
        model: Name in `vision.calibration.lens.LENSES`.
        fit_k3: Fit k3 of "brown", too; otherwise it is 0.
    """

    model: str = "brown"
    fit_k3: bool = False

    def __str__(self) -> str:
        return f"--model {self.model}{' --k3' if self.fit_k3 else ''}"


LENS_CHOICES = (LensChoice(), LensChoice(fit_k3=True), LensChoice("fisheye"))


def fit_lens(
    views: Sequence[FloatArray], board: Board, size: tuple[int, int], lens: LensChoice
) -> Adjustment:
    """Fit camera and poses to views, without a first guess."""
    observations = corner_observations(views, board)
    try:
        first = initial_camera(observations, size, lens.model)
    except UserError:
        raise UserError(UNDETERMINED) from None
    return _adjusted(first, observations, lens)


def held_out_rms(views: Sequence[FloatArray], board: Board, camera: Camera, lens: LensChoice) -> float:
    """Root mean square reprojection error, pixels, by k-fold cross-validation over the views.

    In a view that was left out, each half of the corners gives the pose from which the other half is
    predicted.
    """
    folds, none = min(FOLDS, len(views)), np.zeros(len(camera.intrinsic_names), dtype=bool)
    distances = []
    for fold in range(folds):
        left_out = np.asarray(views[fold::folds])
        others = [view for number, view in enumerate(views) if number % folds != fold]
        kept = corner_observations(others, board)
        trained = _adjusted(camera, kept, lens).camera
        for half in board.halves:
            known = corner_observations(np.where(half[:, None], left_out, np.nan), board)
            asked = corner_observations(np.where(half[:, None], np.nan, left_out), board)
            poses = adjust(trained, initial_poses(trained, known), known, free=none).poses
            distances.append(trained.project(poses.to_camera(asked.points, asked.view)) - asked.pixels)
    return rms(distances)


def _adjusted(camera: Camera, observations: CornerObservations, lens: LensChoice) -> Adjustment:
    """Fit camera and poses from a first guess of the camera."""
    free = np.array([lens.fit_k3 or lens.model != "brown" or name != "k3" for name in camera.intrinsic_names])
    try:
        adjusted = adjust(camera, initial_poses(camera, observations), observations, free=free)
    except (UserError, np.linalg.LinAlgError):
        raise UserError(UNDETERMINED) from None
    deviation = adjusted.independent[:2] / adjusted.camera.intrinsics[:2]
    error = max(rms([adjusted.residuals]), 1e-9)
    if not (deviation * max(1, CORNER_ERROR / error) < LARGEST_DEVIATION).all():
        raise UserError(UNDETERMINED)
    return adjusted


def initial_camera(observations: CornerObservations, size: tuple[int, int], model: str) -> Camera:
    """First guess: no distortion, principal point in the middle, the best of `FOCAL_LENGTHS`.

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


def rms(distances: Sequence[FloatArray]) -> float:
    """Root mean square length of vectors, shapes (n, 2); NaN does not count."""
    return float(np.sqrt(np.nanmean(np.sum(np.concatenate(distances) ** 2, axis=1))))

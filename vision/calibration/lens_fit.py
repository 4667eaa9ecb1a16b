"""Fit of camera and lens to views of a board, and its error in other views. Units: pixels."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from vision.calibration.board_views import corner_observations
from vision.calibration.bundle_adjustment import Adjustment, CornerObservations, adjust
from vision.calibration.camera import Camera
from vision.calibration.chessboard import Board
from vision.calibration.initial_estimate import initial_camera, initial_poses

FOLDS = 5
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
    deviation = np.array(adjusted.camera.standard_deviations)[:2] / adjusted.camera.intrinsics[:2]
    error = max(rms([adjusted.residuals]), 1e-9)
    if not (deviation * max(1, CORNER_ERROR / error) < LARGEST_DEVIATION).all():
        raise UserError(UNDETERMINED)
    return adjusted


def rms(distances: Sequence[FloatArray]) -> float:
    """Root mean square length of vectors, shapes (n, 2); NaN does not count."""
    return float(np.sqrt(np.nanmean(np.sum(np.concatenate(distances) ** 2, axis=1))))

"""A lens fitted to views of a board, and how well it predicts other views. Units: pixels."""

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
CORNER_ERROR, LARGEST_DOUBT = 0.1, 0.05
"""Pixels; a camera whose focal length such errors change by more than this share is not determined."""
UNDETERMINED = (
    "the photographs do not determine the camera; take some with the board tilted by 20 to 45 degrees in "
    "different directions"
)


class LensChoice(NamedTuple):
    """Which lens is fitted.

    Attributes:
        model: Its name in `vision.calibration.lens.LENSES`.
        fit_k3: Whether k3 of "brown" is fitted too; 0 otherwise.
    """

    model: str = "brown"
    fit_k3: bool = False

    def __str__(self) -> str:
        return f"--model {self.model}{' --k3' if self.fit_k3 else ''}"


LENS_CHOICES = (LensChoice(), LensChoice(fit_k3=True), LensChoice("fisheye"))


def fit_lens(
    views: Sequence[FloatArray], board: Board, size: tuple[int, int], lens: LensChoice
) -> Adjustment:
    """Camera and poses from nothing but the views."""
    observations = corner_observations(views, board)
    try:
        first = initial_camera(observations, size, lens.model)
    except UserError:
        raise UserError(UNDETERMINED) from None
    return _adjusted(first, observations, lens)


def held_out_rms(views: Sequence[FloatArray], board: Board, camera: Camera, lens: LensChoice) -> float:
    """Root mean square error of prediction, pixels, by k-fold cross-validation over the views.

    In a view that was left out, half of the corners gives the pose and the rest are predicted; then the
    other way round.
    """
    folds, none = min(FOLDS, len(views)), np.zeros(len(camera.intrinsic_names), dtype=bool)
    distances = []
    for fold in range(folds):
        left_out = np.asarray(views[fold::folds])
        kept = corner_observations(
            [view for number, view in enumerate(views) if number % folds != fold], board
        )
        trained = _adjusted(camera, kept, lens).camera
        for half in board.halves:
            known = corner_observations(np.where(half[:, None], left_out, np.nan), board)
            asked = corner_observations(np.where(half[:, None], np.nan, left_out), board)
            poses = adjust(trained, initial_poses(trained, known), known, free=none).poses
            distances.append(trained.project(poses.place(asked.points, asked.view)) - asked.pixels)
    return rms(distances)


def _adjusted(camera: Camera, observations: CornerObservations, lens: LensChoice) -> Adjustment:
    """Camera and poses from a camera that is nearly right."""
    free = np.array([lens.fit_k3 or lens.model != "brown" or name != "k3" for name in camera.intrinsic_names])
    try:
        adjusted = adjust(camera, initial_poses(camera, observations), observations, free=free)
    except (UserError, np.linalg.LinAlgError):
        raise UserError(UNDETERMINED) from None
    doubt = np.array(adjusted.camera.standard_deviations)[:2] / adjusted.camera.intrinsics[:2]
    error = max(rms([adjusted.residuals]), 1e-9)
    if not (doubt * max(1, CORNER_ERROR / error) < LARGEST_DOUBT).all():
        raise UserError(UNDETERMINED)
    return adjusted


def rms(distances: Sequence[FloatArray]) -> float:
    """Root of the mean squared length, of shapes (n, 2); NaN does not count."""
    return float(np.sqrt(np.nanmean(np.sum(np.concatenate(distances) ** 2, axis=1))))

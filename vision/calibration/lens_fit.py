"""Fit of camera and lens to views of a board, from first guesses on, and its error in other views.

Units: mm, pixels.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
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
ALIKE = 3.0
"""Largest ratio of the reprojection errors of the two poses that a plane may have for both to be tried."""
GAIN = 1e-6
"""Relative change of the sum of squares from which on another pose is better."""


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
    adjusted = _adjusted(first, observations, lens)
    for view, pose in _other_poses(adjusted, observations):
        rotations, translations = adjusted.poses.rotations.as_rotvec(), adjusted.poses.translations.copy()
        rotations[view], translations[view] = np.split(pose, 2)
        poses = Poses(Rotation.from_rotvec(rotations), translations)
        with suppress(UserError):
            other = _adjusted(adjusted.camera, observations, lens, poses)
            if (other.residuals**2).sum() < (1 - GAIN) * (adjusted.residuals**2).sum():
                adjusted = other
    return _determined(adjusted)


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
        trained = _determined(_adjusted(camera, kept, lens)).camera
        for half in board.halves:
            known = corner_observations(np.where(half[:, None], left_out, np.nan), board)
            asked = corner_observations(np.where(half[:, None], np.nan, left_out), board)
            poses = adjust(trained, initial_poses(trained, known), known, free=none).poses
            distances.append(trained.project(poses.to_camera(asked.points, asked.view)) - asked.pixels)
    return rms(distances)


def _adjusted(
    camera: Camera, observations: CornerObservations, lens: LensChoice, poses: Poses | None = None
) -> Adjustment:
    """Fit camera and poses from a first guess of the camera, and of the poses if there is one."""
    free = np.array([lens.fit_k3 or lens.model != "brown" or name != "k3" for name in camera.intrinsic_names])
    try:
        return adjust(camera, poses or initial_poses(camera, observations), observations, free=free)
    except (UserError, np.linalg.LinAlgError):
        raise UserError(UNDETERMINED) from None


def _determined(adjusted: Adjustment) -> Adjustment:
    """The same.

    Raises:
        UserError: If the views do not determine the focal lengths.
    """
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
    found = [poses for poses, _ in _planar_poses(camera, observations)]
    if not all(len(poses) and np.isfinite(poses[0]).all() for poses in found):
        raise UserError("the corners of a view are no image of a plane")
    rotations, translations = np.split(np.array([poses[0] for poses in found]), 2, axis=1)
    return Poses(Rotation.from_rotvec(rotations), translations)


def _planar_poses(
    camera: Camera, observations: CornerObservations
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Poses that the plane of every view may have, shape (k, 6), and their errors, pixels; the best first."""
    straight = camera.undistort(observations.pixels)
    points, pixels = (np.split(each, observations.starts[1:]) for each in (observations.points, straight))
    for corners, seen in zip(points, pixels, strict=True):
        try:
            _, rotations, translations, errors = cv2.solvePnPGeneric(
                corners, seen, camera.matrix, np.zeros(4), flags=cv2.SOLVEPNP_IPPE
            )
        except cv2.error:
            yield np.empty((0, 6)), np.empty(0)
            continue
        poses = np.column_stack([np.reshape(part, (-1, 3)) for part in (rotations, translations)])
        yield poses.astype(np.float64), np.ravel(errors)


def _other_poses(adjusted: Adjustment, observations: CornerObservations) -> Iterator[tuple[int, FloatArray]]:
    """Views whose board could also have another pose than the fitted one, and that pose, shape (6,).

    A distant plane looks almost the same when it is tilted the other way: while the lens is not known, the
    first guess may be the wrong one, and the fit ends in another minimum.

    Source: G. Schweighofer, A. Pinz, "Robust pose estimation from a planar target", IEEE TPAMI 28, 2006.
    """
    for view, (poses, errors) in enumerate(_planar_poses(adjusted.camera, observations)):
        if len(poses) > 1 and np.isfinite(poses).all():
            fitted = adjusted.poses.rotations[view].inv()
            other = int((Rotation.from_rotvec(poses[:, :3]) * fitted).magnitude().argmax())
            if errors[other] < ALIKE * errors[0]:
                yield view, poses[other]


def rms(distances: Sequence[FloatArray]) -> float:
    """Root mean square length of vectors, shapes (n, 2); NaN does not count."""
    return float(np.sqrt(np.nanmean(np.sum(np.concatenate(distances) ** 2, axis=1))))

"""Fit of camera and lens to views of a board, and its error in other views.

A view is the corners in one photograph, in the order of the board, shape (n, 2), pixels, NaN where one is not
seen. Units: mm, pixels.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import NamedTuple

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.calibration.bundle_adjustment import Adjustment, Poses, adjust
from pinnray.vision.calibration.camera import LENSES, Camera
from pinnray.vision.calibration.chessboard import Board

UNDETERMINED = (
    "the photographs do not determine the camera; take some with the board tilted by 20 to 45 degrees in "
    "different directions"
)


class UnusableViewsError(UserError):
    """Some views are no image of the board; `numbers` are theirs."""

    def __init__(self, numbers: Sequence[int]) -> None:
        super().__init__("the corners of a view are no image of the board")
        self.numbers = tuple(numbers)


class LensChoice(NamedTuple):
    """Lens model to fit: a name in `LENSES`, and whether k3 of "brown" is fitted; otherwise it is 0."""

    model: str = "brown"
    fit_k3: bool = False

    def __str__(self) -> str:
        return f"lens model {self.model}{' with k3' if self.fit_k3 else ''}"


LENS_CHOICES = (LensChoice(), LensChoice(fit_k3=True), LensChoice("fisheye"))


def fit_lens(
    views: Sequence[FloatArray], board: Board, size: tuple[int, int], lens: LensChoice
) -> Adjustment:
    """Fit camera and poses to views in images of `size`, (width, height), without a first guess.

    Raises:
        UnusableViewsError: If some views are no image of the board, whatever the focal length.
        UserError: If the views do not determine the camera.
    """
    fit = _adjusted(_first_camera(views, board, size, lens.model), views, board, lens)
    for view, pose in _other_poses(fit, views, board):
        rotations, translations = fit.poses.rotations.as_rotvec(), fit.poses.translations.copy()
        rotations[view], translations[view] = np.split(pose, 2)
        with suppress(UserError):
            other = _adjusted(
                fit.camera, views, board, lens, Poses(Rotation.from_rotvec(rotations), translations)
            )
            if np.nansum(other.residuals**2) < (1 - 1e-6) * np.nansum(fit.residuals**2):
                fit = other
    _check_determined(fit)
    return fit


def held_out_rms(views: Sequence[FloatArray], board: Board, camera: Camera, lens: LensChoice) -> float:
    """Root mean square reprojection error, pixels, by 5-fold cross-validation over the views.

    In a view outside the training set, each half of the corners gives the pose that predicts the other half,
    if it determines one.

    Raises:
        UserError: If the views do not determine the camera, or no half determines a pose.
    """
    folds, distances = min(5, len(views)), []
    for fold in range(folds):
        others = [view for number, view in enumerate(views) if number % folds != fold]
        fit = _adjusted(camera, others, board, lens)
        _check_determined(fit)
        tested, none = np.asarray(views[fold::folds]), np.zeros(len(camera.intrinsic_names), dtype=bool)
        for half in board.halves:
            able = [board.determines_pose(half & np.isfinite(view[:, 0])) for view in tested]
            if not any(able):
                continue
            shown = tested[able]
            known = np.where(half[:, None], shown, np.nan)
            poses = adjust(fit.camera, _first_poses(fit.camera, known, board), known, board, free=none).poses
            view, corner = np.nonzero(np.isfinite(shown[:, :, 0]) & ~half)
            predicted = fit.camera.project(poses.to_camera(board.corners[corner], view))
            distances.append(predicted - shown[view, corner])
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


def _adjusted(
    camera: Camera, views: Sequence[FloatArray], board: Board, lens: LensChoice, poses: Poses | None = None
) -> Adjustment:
    """Fit camera and poses from a first guess of the camera, and of the poses if there is one."""
    free = np.array([lens != LENS_CHOICES[0] or name != "k3" for name in camera.intrinsic_names])
    try:
        return adjust(camera, poses or _first_poses(camera, views, board), views, board, free=free)
    except (UserError, np.linalg.LinAlgError):
        raise UserError(UNDETERMINED) from None


def _check_determined(fit: Adjustment) -> None:
    """Raise `UserError` unless corner errors of 0.1 pixels leave the focal lengths known within 5 %."""
    deviation = fit.independent[:2] / fit.camera.intrinsics[:2]
    if not (deviation * max(1, 0.1 / max(rms([fit.residuals]), 1e-9)) < 0.05).all():
        raise UserError(UNDETERMINED)


def _first_camera(views: Sequence[FloatArray], board: Board, size: tuple[int, int], model: str) -> Camera:
    """The best camera without distortion whose principal point is in the middle.

    Raises:
        UnusableViewsError: If no focal length gives poses for all views; it names those without one at the
            focal length that gives most.
    """
    best, least = None, (len(views), np.inf)
    failed: list[int] = []
    for widths in 2.0 ** np.arange(-2.5, 4.5, 0.5):  # angles of view from 140 to 4 degrees; fisheye: beyond
        focal, (x, y) = float(size[0] * widths), ((side - 1) / 2 for side in size)
        camera = Camera(*size, focal, focal, x, y, (0.0,) * len(LENSES[model]), model)
        costs = [_misfit(camera, view, board) for view in views]
        lost = [number for number, cost in enumerate(costs) if not np.isfinite(cost)]
        if (total := (len(lost), float(np.sum(np.delete(costs, lost))))) < least:
            best, least, failed = camera, total, lost
    if best is None:
        raise UserError(UNDETERMINED)
    if failed:
        raise UnusableViewsError(failed)
    return best


def _misfit(camera: Camera, view: FloatArray, board: Board) -> float:
    """Sum of squared reprojection errors of a view's first guess, pixels²; infinite if there is none."""
    seen = np.isfinite(view[:, 0])
    try:
        placed = _first_poses(camera, [view], board).to_camera(board.corners[seen], np.zeros(seen.sum(), int))
        return float(np.sum((camera.project(placed) - view[seen]) ** 2))
    except UserError:
        return np.inf


def _first_poses(camera: Camera, views: Sequence[FloatArray] | FloatArray, board: Board) -> Poses:
    """First guess of the board's pose in every view.

    Source: T. Collins, A. Bartoli, "Infinitesimal plane-based pose estimation", IJCV 109, 2014, as in OpenCV.

    Raises:
        UserError: If the corners of a view are no image of a plane, or the distortion cannot be undone there.
    """
    found = [poses for poses, _ in _planar_poses(camera, views, board)]
    if not all(len(poses) and np.isfinite(poses[0]).all() for poses in found):
        raise UserError("the corners of a view are no image of a plane")
    rotations, translations = np.split(np.array([poses[0] for poses in found]), 2, axis=1)
    return Poses(Rotation.from_rotvec(rotations), translations)


def _planar_poses(
    camera: Camera, views: Sequence[FloatArray] | FloatArray, board: Board
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Possible poses of the plane of every view, shape (k, 6), and their errors, pixels; the best first."""
    for view in views:
        seen = np.isfinite(view[:, 0])
        straight = camera.undistort(view[seen])
        try:
            _, rotations, translations, errors = cv2.solvePnPGeneric(
                board.corners[seen], straight, camera.matrix, np.zeros(4), flags=cv2.SOLVEPNP_IPPE
            )
        except cv2.error:
            yield np.empty((0, 6)), np.empty(0)
            continue
        poses = np.column_stack([np.reshape(part, (-1, 3)) for part in (rotations, translations)])
        yield poses.astype(np.float64), np.ravel(errors)


def _other_poses(
    fit: Adjustment, views: Sequence[FloatArray], board: Board
) -> Iterator[tuple[int, FloatArray]]:
    """Views whose board could also have another pose than the fitted one, and that pose, shape (6,).

    A distant plane looks almost the same when it is tilted the other way: while the lens is not known, the
    first guess may be the wrong one, and the fit ends in another minimum.

    Source: G. Schweighofer, A. Pinz, "Robust pose estimation from a planar target", IEEE TPAMI 28, 2006.
    """
    for view, (poses, errors) in enumerate(_planar_poses(fit.camera, views, board)):
        if len(poses) > 1 and np.isfinite(poses).all():
            fitted = fit.poses.rotations[view].inv()
            other = int((Rotation.from_rotvec(poses[:, :3]) * fitted).magnitude().argmax())
            if errors[other] < 3 * errors[0]:  # both explain the corners about as well
                yield view, poses[other]

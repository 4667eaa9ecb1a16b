"""A camera from photographs of a board, with what is known about its errors.

Z. Zhang, "A flexible new technique for camera calibration", IEEE TPAMI 22, 2000: a plane seen in several
poses determines the camera. All intrinsics and poses are fitted by least squares. The fit's own residuals
flatter it, so `held_out` repeats it without some of the photographs and asks how well it predicts corners
there. Units: pixels, mm.
"""

import warnings
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from vision.adjustment import Adjusted, Sightings, adjust
from vision.board import Board, GreyImage
from vision.camera import Camera
from vision.first_guess import board_poses, first_camera

FEWEST_VIEWS = 4
FOLDS = 5
LEAST_COVERAGE = 0.6
"""Share of the image below which the distortion near its edges is a guess."""
GUESSES = 8
"""Photographs that are asked what board they show if it is not the expected one."""
OUTLIER = 3.0
"""Error of a view in medians of all from which it deserves a look."""
CORNER_ERROR, LARGEST_DOUBT = 0.1, 0.05
"""Pixels; a camera whose focal length such errors change by more than this share is not determined."""
UNDETERMINED = (
    "the photographs do not determine the camera; take some with the board tilted by 20 to 45 degrees in "
    "different directions"
)


class LensChoice(NamedTuple):
    """Which lens is fitted.

    Attributes:
        model: Its name in `vision.lens.LENSES`.
        fit_k3: Whether k3 of "brown" is fitted too; 0 otherwise.
    """

    model: str = "brown"
    fit_k3: bool = False

    def __str__(self) -> str:
        return f"--model {self.model}{' --k3' if self.fit_k3 else ''}"


LENS_CHOICES = (LensChoice(), LensChoice(fit_k3=True), LensChoice("fisheye"))


@dataclass(frozen=True, eq=False)
class Calibration:
    """A camera and how well it is known.

    Attributes:
        camera: With covariance.
        board: What was photographed.
        views: Where its corners were seen, by the name of the photograph, shape (n, 2), pixels;
            NaN where one was not seen.
        residuals: Seen minus predicted by the fit, likewise.
        held_out: Root mean square distance in photographs that the camera was not fitted to, pixels.
        coverage: Share of the image area that was inside a board at least once.
        boardless: Names of the photographs in which no board was found.
    """

    camera: Camera
    board: Board
    views: Mapping[str, FloatArray]
    residuals: Mapping[str, FloatArray]
    held_out: float
    coverage: float
    boardless: tuple[str, ...] = ()

    @property
    def rms(self) -> float:
        """Root mean square distance between corners and their projections in the fit, pixels."""
        return _rms(list(self.residuals.values()))

    @property
    def view_errors(self) -> dict[str, float]:
        """The same for every photograph that shows the board, by name."""
        return {name: _rms([residuals]) for name, residuals in self.residuals.items()}


def calibrate(
    images: Iterable[tuple[str, GreyImage]], board: Board, *, lens: LensChoice = LENS_CHOICES[0]
) -> Calibration:
    """Calibrate a camera from photographs of a board.

    Args:
        images: Names and grey photographs, all of one size; only one is held at a time.
        board: What they show.
        lens: What is fitted.

    Raises:
        UserError: If the sizes differ, fewer than 4 photographs show the board, or they do not determine the
            camera.
    """
    views, boardless, guesses, first = {}, [], Counter[str](), ("", (0, 0))
    for name, image in images:
        size = (image.shape[1], image.shape[0])
        first = first if first[0] else (name, size)
        if size != first[1]:
            raise UserError(
                f"{first[0]} has {first[1][0]}x{first[1][1]} pixels and {name} {size[0]}x{size[1]}; "
                "photographs for one calibration must have one size"
            )
        corners = board.find(image)
        if corners is not None:
            views[name] = corners
        else:
            boardless.append(name)
            if len(views) < FEWEST_VIEWS and len(boardless) <= GUESSES and (guess := board.seems(image)):
                guesses[guess] += 1
    guess, votes = guesses.most_common(1)[0] if guesses else ("", 0)
    if len(views) < FEWEST_VIEWS and votes > max(1, len(views)):
        raise UserError(
            f"{len(views)} of {len(views) + len(boardless)} photographs show the board of {board}; "
            f"{votes} seem to show {guess}"
        )
    return calibrate_views(views, board, first[1], lens=lens, boardless=tuple(boardless))


def calibrate_views(
    views: Mapping[str, FloatArray],
    board: Board,
    size: tuple[int, int],
    *,
    lens: LensChoice = LENS_CHOICES[0],
    boardless: tuple[str, ...] = (),
) -> Calibration:
    """Calibrate a camera from the corners of a board in images of `size`, (width, height).

    Args:
        views: By name, in the order of `board.corners`, shape (n, 2), pixels; NaN where one was not seen.
        board: Whose corners they are.
        size: Of the images, pixels.
        lens: What is fitted.
        boardless: What to call the photographs without a board.

    Raises:
        UserError: If there are fewer than 4 views, or they do not determine the camera.
    """
    if len(views) < FEWEST_VIEWS:
        raise UserError(
            f"{len(views)} of {len(views) + len(boardless)} photographs show the board of {board}; "
            f"at least {FEWEST_VIEWS} must, better 15, tilted in different directions"
        )
    corners = list(views.values())
    adjusted = _fit(corners, board, size, lens)
    calibration = Calibration(
        camera=adjusted.camera,
        board=board,
        views=views,
        residuals=dict(zip(views, _by_view(adjusted.residuals, corners), strict=True)),
        held_out=held_out(corners, board, adjusted.camera, lens),
        coverage=_coverage(corners, size),
        boardless=boardless,
    )
    _warn(calibration)
    return calibration


def better_lens(
    calibration: Calibration, lens: LensChoice, *, ratio: float = 0.8
) -> tuple[LensChoice, float] | None:
    """A lens that would bring the error held out below `ratio` of what it is, and that error, pixels."""
    camera, corners = calibration.camera, list(calibration.views.values())
    errors = {}
    for other in LENS_CHOICES:
        if other != lens:
            try:
                fitted = _fit(corners, calibration.board, (camera.width, camera.height), other).camera
                errors[other] = held_out(corners, calibration.board, fitted, other)
            except UserError:
                continue
    best = min(errors, key=errors.__getitem__, default=lens)
    return (best, errors[best]) if errors.get(best, np.inf) < ratio * calibration.held_out else None


def held_out(views: Sequence[FloatArray], board: Board, camera: Camera, lens: LensChoice) -> float:
    """Root mean square error of prediction, pixels, by k-fold cross-validation over the views.

    In a view that was left out, half of the corners gives the pose and the rest are predicted; then the
    other way round.
    """
    folds, none = min(FOLDS, len(views)), np.zeros(len(camera.names), dtype=bool)
    distances = []
    for fold in range(folds):
        kept = _sightings([view for number, view in enumerate(views) if number % folds != fold], board)
        trained = _adjusted(camera, kept, lens).camera
        for half in board.halves:
            known = _sightings([np.where(half[:, None], view, np.nan) for view in views[fold::folds]], board)
            asked = _sightings([np.where(half[:, None], np.nan, view) for view in views[fold::folds]], board)
            poses = adjust(trained, board_poses(trained, known), known, free=none).poses
            distances.append(trained.project(poses.place(asked.points, asked.view)) - asked.pixels)
    return _rms(distances)


def _fit(views: Sequence[FloatArray], board: Board, size: tuple[int, int], lens: LensChoice) -> Adjusted:
    """Camera and poses from nothing but the views."""
    sightings = _sightings(views, board)
    try:
        first = first_camera(sightings, size, lens.model)
    except UserError:
        raise UserError(UNDETERMINED) from None
    return _adjusted(first, sightings, lens)


def _adjusted(camera: Camera, sightings: Sightings, lens: LensChoice) -> Adjusted:
    """Camera and poses from a camera that is nearly right."""
    free = np.array([lens.fit_k3 or lens.model != "brown" or name != "k3" for name in camera.names])
    try:
        adjusted = adjust(camera, board_poses(camera, sightings), sightings, free=free)
    except (UserError, np.linalg.LinAlgError):
        raise UserError(UNDETERMINED) from None
    doubt = np.array(adjusted.camera.standard_deviations)[:2] / adjusted.camera.intrinsics[:2]
    rms = max(_rms([adjusted.residuals]), 1e-9)
    if not (doubt * max(1, CORNER_ERROR / rms) < LARGEST_DOUBT).all():
        raise UserError(UNDETERMINED)
    return adjusted


def _sightings(views: Sequence[FloatArray], board: Board) -> Sightings:
    seen = np.isfinite(views).all(axis=2)
    view, corner = np.nonzero(seen)
    return Sightings(board.corners[corner], np.asarray(views)[seen], view)


def _by_view(residuals: FloatArray, views: Sequence[FloatArray]) -> FloatArray:
    """Residuals in the shape of the views, (views, n, 2), NaN where a corner was not seen."""
    spread = np.full(np.shape(views), np.nan)
    spread[np.isfinite(views).all(axis=2)] = residuals
    return spread


def _rms(distances: Sequence[FloatArray]) -> float:
    """Root of the mean squared length, of shapes (n, 2); NaN does not count."""
    return float(np.sqrt(np.nanmean(np.sum(np.concatenate(distances) ** 2, axis=1))))


def _coverage(views: Sequence[FloatArray], size: tuple[int, int]) -> float:
    """Share of the pixels that lie between the corners of some view."""
    covered = np.zeros(size[::-1], dtype=np.uint8)
    for view in views:
        seen = view[np.isfinite(view).all(axis=1)]
        cv2.fillConvexPoly(covered, cv2.convexHull(np.rint(seen).astype(np.int32)), [1])
    return float(covered.mean())


def _warn(calibration: Calibration) -> None:
    """Say what would make the calibration better."""
    errors = calibration.view_errors
    usual = float(np.median(list(errors.values())))
    for name, error in errors.items():
        if error > OUTLIER * usual:
            warnings.warn(
                f"{name} has an error of {error:.2f} px, the median is {usual:.2f} px; look whether it is "
                f"blurred or the board bent, or calibrate without it: --without {name}",
                stacklevel=3,
            )
    if calibration.coverage < LEAST_COVERAGE:
        warnings.warn(
            f"the boards cover {calibration.coverage:.0%} of the image, less than {LEAST_COVERAGE:.0%}: "
            "beyond them the distortion is a guess; add photographs with the board near edges and corners",
            stacklevel=3,
        )

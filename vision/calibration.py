"""A camera from photographs of a chessboard, with what is known about its errors.

Z. Zhang, "A flexible new technique for camera calibration", IEEE TPAMI 22, 2000, as in OpenCV. The standard
deviations are those of the least-squares fit. The fit's own residuals flatter it, so `held_out` repeats it
without some of the photographs and asks how well it predicts corners there. Units: pixels, mm.
"""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from vision.board import Board, GreyImage
from vision.camera import Camera, Pose

FEWEST_VIEWS = 4
FOLDS = 5
LEAST_COVERAGE = 0.6
"""Share of the image below which the distortion near its edges is a guess."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """A camera and how well it is known.

    Attributes:
        camera: With standard deviations.
        rms: Root mean square distance between corners and their projections in the fit, pixels.
        view_errors: The same for every photograph that shows the board, pixels, by name.
        held_out: Root mean square distance in photographs that the camera was not fitted to, pixels.
        coverage: Share of the image area that was inside a board at least once.
        boardless: Names of the photographs in which no board was found.
    """

    camera: Camera
    rms: float
    view_errors: Mapping[str, float]
    held_out: float
    coverage: float
    boardless: tuple[str, ...] = ()


def calibrate(images: Mapping[str, GreyImage], board: Board, *, fit_k3: bool = False) -> Calibration:
    """Calibrate a camera from photographs of a chessboard.

    Args:
        images: Grey photographs by name, all of one size.
        board: What they show.
        fit_k3: Whether the third radial coefficient is fitted too; 0 otherwise.

    Raises:
        UserError: If the sizes differ, fewer than 4 photographs show the board, or they do not determine the
            camera.
    """
    sizes = {image.shape[1::-1]: name for name, image in images.items()}
    if len(sizes) > 1:
        (first, one), (second, other), *_ = sizes.items()
        raise UserError(
            f"{one} has {first[0]}x{first[1]} pixels and {other} {second[0]}x{second[1]}; "
            "photographs for one calibration must have one size"
        )
    found = {name: board.find(image) for name, image in images.items()}
    views = {name: corners for name, corners in found.items() if corners is not None}
    boardless = tuple(name for name, corners in found.items() if corners is None)
    if not views:
        raise UserError(
            f"none of {len(images)} photographs shows a board of {board} inner corners as a whole; count them"
        )
    ((width, height),) = sizes
    return calibrate_views(views, board, (width, height), fit_k3=fit_k3, boardless=boardless)


def calibrate_views(
    views: Mapping[str, FloatArray],
    board: Board,
    size: tuple[int, int],
    *,
    fit_k3: bool = False,
    boardless: tuple[str, ...] = (),
) -> Calibration:
    """Calibrate a camera from the corners of a board in images of `size`, (width, height).

    Args:
        views: By name, in the order of `board.corners`, shape (n, 2), pixels.
        board: Whose corners they are.
        size: Of the images, pixels.
        fit_k3: Whether the third radial coefficient is fitted too; 0 otherwise.
        boardless: What to call the photographs without a board.

    Raises:
        UserError: If there are fewer than 4 views, or they do not determine the camera.
    """
    if len(views) < FEWEST_VIEWS:
        raise UserError(
            f"{len(views)} of {len(views) + len(boardless)} photographs show the board of {board} corners; "
            f"at least {FEWEST_VIEWS} must, better 15, tilted in different directions"
        )
    corners = list(views.values())
    camera, rms, errors = _fit(corners, board, size, fit_k3=fit_k3)
    calibration = Calibration(
        camera=camera,
        rms=rms,
        view_errors=dict(zip(views, errors.tolist(), strict=True)),
        held_out=_held_out(corners, board, size, fit_k3=fit_k3),
        coverage=_coverage(corners, board, size),
        boardless=boardless,
    )
    if calibration.coverage < LEAST_COVERAGE:
        warnings.warn(
            f"the boards cover {calibration.coverage:.0%} of the image, less than {LEAST_COVERAGE:.0%}: "
            "beyond them the distortion is a guess; add photographs with the board near edges and corners",
            stacklevel=2,
        )
    return calibration


def _fit(
    views: Sequence[FloatArray], board: Board, size: tuple[int, int], *, fit_k3: bool
) -> tuple[Camera, float, FloatArray]:
    """The camera, the root mean square distance, and that of every view, pixels."""
    points = [board.corners.astype(np.float32)] * len(views)
    flags = 0 if fit_k3 else cv2.CALIB_FIX_K3
    try:
        rms, matrix, distortion, _, _, deviations, _, errors = cv2.calibrateCameraExtended(
            points, [view.astype(np.float32) for view in views], size, np.eye(3), np.zeros(5), flags=flags
        )
        camera = Camera(
            width=size[0],
            height=size[1],
            fx=float(matrix[0, 0]),
            fy=float(matrix[1, 1]),
            cx=float(matrix[0, 2]),
            cy=float(matrix[1, 2]),
            distortion=tuple(np.ravel(distortion)[:5].tolist()),
            standard_deviations=tuple(np.ravel(deviations)[:9].tolist()),
        )
    except (cv2.error, UserError):
        raise UserError(
            "the photographs do not determine the camera; take some with the board tilted by 20 to 45 "
            "degrees in different directions"
        ) from None
    return camera, float(rms), np.ravel(errors).astype(np.float64)


def _held_out(views: Sequence[FloatArray], board: Board, size: tuple[int, int], *, fit_k3: bool) -> float:
    """Root mean square error of prediction, pixels, by k-fold cross-validation over the views.

    In a view that was left out, every other corner gives the pose and the rest are predicted, and conversely.
    """
    distances = []
    first = np.arange(len(board.corners)) % 2 == 0
    folds = min(FOLDS, len(views))
    for fold in range(folds):
        kept = [view for number, view in enumerate(views) if number % folds != fold]
        camera, _, _ = _fit(kept, board, size, fit_k3=fit_k3)
        for view in views[fold::folds]:
            for half in (first, ~first):
                pose = _pose(camera, board.corners[half], view[half])
                distances.append(camera.project(board.corners[~half], pose) - view[~half])
    return float(np.sqrt(np.mean(np.sum(np.concatenate(distances) ** 2, axis=1))))


def _pose(camera: Camera, points: FloatArray, pixels: FloatArray) -> Pose:
    """The pose that puts points, shape (n, 3), mm, at pixels, shape (n, 2)."""
    _, rotation, translation = cv2.solvePnP(points, pixels, camera.matrix, np.array(camera.distortion))
    return Pose(np.asarray(rotation, np.float64).ravel(), np.asarray(translation, np.float64).ravel())


def _coverage(views: Sequence[FloatArray], board: Board, size: tuple[int, int]) -> float:
    """Share of the pixels that lie between the corners of some view."""
    covered = np.zeros(size[::-1], dtype=np.uint8)
    outer = np.array([0, board.columns - 1, len(board.corners) - 1, len(board.corners) - board.columns])
    for view in views:
        cv2.fillConvexPoly(covered, np.rint(view[outer]).astype(np.int32), [1])
    return float(covered.mean())

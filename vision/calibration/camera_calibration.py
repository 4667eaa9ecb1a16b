"""Camera calibration from photographs of a board, with covariance and reprojection errors.

Z. Zhang, "A flexible new technique for camera calibration", IEEE TPAMI 22, 2000: a plane seen in several
poses determines the camera. All intrinsics and poses are fitted by least squares. The residuals of the fit
underestimate its error, so `held_out_rms` predicts corners in photographs that were left out of it.
Units: pixels, mm.
"""

import math
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import cv2
import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.calibration.camera import Camera
from pinnray.vision.calibration.camera_fit import fit_camera, held_out_rms, rms
from pinnray.vision.calibration.chessboard import Board
from pinnray.vision.frames.frame import GreyImage

FEWEST_VIEWS = 4
LEAST_COVERAGE = 0.6
"""Share of the image below which the distortion near its edges is extrapolated."""
OUTLIER = 3.0
"""Reprojection error of a view, in medians of all views, above which a warning names it."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated camera with its reprojection errors.

    Attributes:
        camera: With covariance.
        board: In the photographs.
        views: Corners by the name of the photograph, shape (n, 2), pixels; NaN where one was not seen.
        residuals: Observed minus predicted by the fit, likewise.
        held_out_rms: Root mean square reprojection error in photographs left out of the fit, pixels.
        coverage: Share of the image area that was inside a board at least once.
        left_out: Reasons why photographs were not used, by name.
    """

    camera: Camera
    board: Board
    views: Mapping[str, FloatArray]
    residuals: Mapping[str, FloatArray]
    held_out_rms: float
    coverage: float
    left_out: Mapping[str, str] = field(default_factory=dict)

    @property
    def rms(self) -> float:
        """Root mean square reprojection error of the fit, pixels."""
        return rms(list(self.residuals.values()))

    @property
    def view_errors(self) -> dict[str, float]:
        """Root mean square reprojection error of every photograph with the board, by name, pixels."""
        return {name: rms([residuals]) for name, residuals in self.residuals.items()}


def calibrate_camera(
    images: Iterable[tuple[str, GreyImage]], board: Board, *, k3: bool = False
) -> Calibration:
    """Calibrate a camera from photographs of a board.

    Args:
        images: Names and grey photographs, all of one size; only one is in memory at a time.
        board: In the photographs.
        k3: Whether to fit the third radial coefficient of the lens; else it is 0.

    Raises:
        UserError: If the sizes differ, fewer than 4 photographs show the board, or they do not determine the
            camera.
    """
    views: dict[str, FloatArray] = {}
    left_out: dict[str, str] = {}
    size, first = (0, 0), ""
    for name, image in images:
        width, height = image.shape[::-1]
        size, first = (size, first) if first else ((width, height), name)
        if size != (width, height):
            raise UserError(
                f"photographs for one calibration must have one size: {first} has {size[0]}x{size[1]} "
                f"pixels, {name} {width}x{height}; leave out those of the other size"
            )
        if (corners := board.find(image)) is None:
            left_out[name] = f"no board of {board} was found"
        else:
            views[name] = corners
    return calibrate_views(views, board, size, k3=k3, left_out=left_out)


def calibrate_views(
    views: Mapping[str, FloatArray],
    board: Board,
    size: tuple[int, int],
    *,
    k3: bool = False,
    left_out: Mapping[str, str] = MappingProxyType({}),
) -> Calibration:
    """Calibrate a camera from the corners of a board in images of `size`, (width, height).

    Views that do not determine the board's pose are left out.

    Args:
        views: By name, in the order of `board.corners`, shape (n, 2), pixels; NaN where one was not seen.
        board: In the images.
        size: Of the images, pixels.
        k3: Whether to fit the third radial coefficient of the lens; else it is 0.
        left_out: Reasons why other photographs are not used, by name.

    Raises:
        UserError: If there are fewer than 4 views, or they do not determine the camera.
    """
    able = {name: view for name, view in views.items() if board.determines_pose(np.isfinite(view[:, 0]))}
    weak = {
        name: f"the {int(np.isfinite(view[:, 0]).sum())} corners that are seen are too few or lie on a line"
        for name, view in views.items()
        if name not in able
    }
    views, left_out = able, {**left_out, **weak}
    if len(views) < FEWEST_VIEWS:
        missing = f"no board of {board} was found"
        reasons = [f"{name}: {reason}" for name, reason in left_out.items() if reason != missing]
        advice = f"at least {FEWEST_VIEWS} must, better 15, tilted in different directions"
        raise UserError(
            f"{len(views)} of {len(views) + len(left_out)} photographs show the board of {board}; "
            + "; ".join([advice if views or reasons else "count them", *reasons])
        )
    corners = list(views.values())
    fitted = fit_camera(corners, board, size, k3=k3)
    residuals = dict(zip(views, fitted.residuals, strict=True))
    held_out, coverage = held_out_rms(corners, board, fitted.camera, k3=k3), _coverage(corners, size)
    calibration = Calibration(fitted.camera, board, views, residuals, held_out, coverage, left_out)
    _warn(calibration)
    return calibration


def _coverage(views: Sequence[FloatArray], size: tuple[int, int]) -> float:
    """Share of the pixels within the convex hull of the corners of at least one view."""
    covered = np.zeros(size[::-1], dtype=np.uint8)
    for view in views:
        seen = view[np.isfinite(view).all(axis=1)]
        cv2.fillConvexPoly(covered, cv2.convexHull(np.rint(seen).astype(np.int32)), [1])
    return float(covered.mean())


def _warn(calibration: Calibration) -> None:
    """Warn of outliers and of low coverage."""
    errors = calibration.view_errors
    usual = float(np.median(list(errors.values())))
    for name, error in errors.items():
        if error > OUTLIER * usual:
            warnings.warn(
                f"{name} has an error of {error:.2f} px, the median is {usual:.2f} px; look whether it is "
                "blurred or the board bent, or calibrate without it",
                stacklevel=3,
            )
    if calibration.coverage < LEAST_COVERAGE:
        warnings.warn(
            f"the boards cover {math.floor(100 * calibration.coverage)}% of the image, less than "
            f"{LEAST_COVERAGE:.0%}: beyond them the distortion is a guess; add photographs with the board "
            "near edges and corners",
            stacklevel=3,
        )

"""A calibration to check: tables of intrinsics and errors, a picture of residuals and coverage."""

from collections.abc import Iterable

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon
from rich.box import SIMPLE_HEAD
from rich.table import Table

from pinnray.comparison.figures.body import round_length
from pinnray.comparison.figures.layout import axes_at, write_heading
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.figure import COLUMN, INK, MEASURED, Figure, figure
from pinnray.vision.calibration.camera import INTRINSICS
from pinnray.vision.calibration.camera_calibration import Calibration

MARGIN, HEAD = 0.12, 0.76
LONGEST = 0.05
"""Drawn length of the 95th percentile of the residuals, in image widths."""
COVERED = "#56b4e9"


def calibration_table(calibration: Calibration) -> Table:
    """The intrinsics with standard deviations, and the reprojection errors."""
    camera = calibration.camera
    table = Table("camera", "value", "±", "unit", box=SIMPLE_HEAD)
    deviations = camera.standard_deviations or (0.0,) * len(INTRINSICS)
    for name, value, deviation in zip(INTRINSICS, camera.intrinsics, deviations, strict=True):
        digits, unit = (5, "") if name[0] in "kp" else (2, "px")
        table.add_row(name, f"{value:.{digits}f}", f"{deviation:.{digits}f}" if deviation else "fixed", unit)
    seen = len(calibration.view_errors)
    table.add_row("rms error of the fit", f"{calibration.rms:.3f}", "", "px")
    table.add_row("rms error held out", f"{calibration.held_out_rms:.3f}", "", "px")
    table.add_row("coverage of the image", f"{100 * calibration.coverage:.0f}", "", "%")
    table.add_row("photographs with the board", f"{seen} of {seen + len(calibration.left_out)}", "", "")
    return table


def draw_calibration(calibration: Calibration) -> Figure:
    """Draw the residuals of all photographs, and the part of the image that they cover."""
    camera = calibration.camera
    wide = COLUMN - 2 * MARGIN
    high = wide * camera.height / camera.width
    longest = np.nanquantile(np.linalg.norm(_all(calibration.residuals.values()), axis=1), 0.95)
    factor = round_length(LONGEST * camera.width / max(longest, 1e-9))
    with figure(HEAD + high + MARGIN, COLUMN) as drawn:
        write_heading(
            drawn,
            f"Calibration from {len(calibration.views)} photographs",
            f"Lines: reprojection errors of the corners, × {factor:g};\n"
            f"rms {calibration.rms:.3f} px, held out {calibration.held_out_rms:.3f} px.\n"
            f"Blue: inside a board, {100 * calibration.coverage:.0f} % of the image.",
        )
        axes = axes_at(drawn, (MARGIN, HEAD, wide, high))
        axes.set(xlim=(-0.5, camera.width - 0.5), ylim=(camera.height - 0.5, -0.5), xticks=[], yticks=[])
        axes.spines[:].set_visible(True)
        _residuals(axes, calibration, factor)
    return drawn


def _residuals(axes: Axes, calibration: Calibration, factor: float) -> None:
    for seen in calibration.views.values():
        corners = seen[np.isfinite(seen).all(axis=1)].astype(np.float32)
        axes.add_patch(Polygon(cv2.convexHull(corners)[:, 0], fc=COVERED, alpha=0.12, lw=0))
    corners, residuals = _all(calibration.views.values()), _all(calibration.residuals.values())
    ends = corners - factor * residuals
    lines = np.stack([corners, ends, np.full_like(ends, np.nan)], axis=1).reshape(-1, 2)
    axes.plot(*lines.T, color=INK, lw=0.5)
    axes.plot(*corners.T, ".", ms=1.2, color=MEASURED)


def _all(arrays: Iterable[FloatArray]) -> FloatArray:
    return np.concatenate(list(arrays))

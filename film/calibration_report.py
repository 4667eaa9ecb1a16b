"""A calibration to check: tables of intrinsics and errors, a picture of residuals, coverage, undistortion."""

from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon
from numpy.typing import NDArray
from rich.box import SIMPLE_HEAD
from rich.table import Table

from pinnray.comparison.figures.layout import axes_at, write_heading
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.figure import INK, MEASURED, MUTED, SMALL, WIDTH, Figure, figure
from pinnray.vision.calibration.camera import Camera
from pinnray.vision.calibration.camera_calibration import Calibration

MARGIN, GAP, HEAD, TITLE = 0.12, 0.14, 0.56, 0.2
LONGEST = 0.05
"""Drawn length of the 95th percentile of the residuals, in image widths."""
COVERED = "#56b4e9"


def calibration_table(calibration: Calibration) -> Table:
    """The intrinsics with standard deviations, and the reprojection errors."""
    camera = calibration.camera
    table = Table("camera", "value", "±", "unit", box=SIMPLE_HEAD)
    deviations = camera.standard_deviations or (0.0,) * len(camera.intrinsic_names)
    for name, value, deviation in zip(camera.intrinsic_names, camera.intrinsics, deviations, strict=True):
        digits, unit = (5, "") if name[0] in "kp" else (2, "px")
        table.add_row(name, f"{value:.{digits}f}", f"{deviation:.{digits}f}" if deviation else "fixed", unit)
    seen = len(calibration.view_errors)
    table.add_row("rms error of the fit", f"{calibration.rms:.3f}", "", "px")
    table.add_row("rms error held out", f"{calibration.held_out_rms:.3f}", "", "px")
    table.add_row("coverage of the image", f"{100 * calibration.coverage:.0f}", "", "%")
    table.add_row("photographs with the board", f"{seen} of {seen + len(calibration.left_out)}", "", "")
    return table


def view_table(calibration: Calibration, *, most: int = 15) -> Table:
    """The reprojection errors of the photographs, largest first."""
    table = Table("photograph", "corners", "rms error, px", box=SIMPLE_HEAD)
    errors = sorted(calibration.view_errors.items(), key=lambda entry: -entry[1])
    for name, error in errors[:most]:
        seen = np.isfinite(calibration.views[name][:, 0]).sum()
        table.add_row(name, f"{seen}", f"{error:.3f}")
    if len(errors) > most:
        table.add_row(f"and {len(errors) - most} with smaller errors", "", "")
    return table


def draw_calibration(calibration: Calibration, name: str, photograph: NDArray[np.uint8]) -> Figure:
    """Draw the residuals of all photographs, and one photograph before and after undistortion.

    Args:
        calibration: The calibration.
        name: Name of the photograph.
        photograph: Its grey levels, shape (height, width).
    """
    camera = calibration.camera
    shape = camera.height / camera.width
    wide, half = WIDTH - 2 * MARGIN, (WIDTH - 2 * MARGIN - GAP) / 2
    below = HEAD + wide * shape + GAP + TITLE
    longest = np.nanquantile(np.linalg.norm(_all(calibration.residuals.values()), axis=1), 0.95)
    factor = _round(LONGEST * camera.width / max(longest, 1e-9))
    with figure(below + half * shape + MARGIN) as drawn:
        write_heading(
            drawn,
            f"Calibration from {len(calibration.views)} photographs",
            f"Lines: reprojection errors of the corners, {factor:g} times as long; rms "
            f"{calibration.rms:.3f} px, held out {calibration.held_out_rms:.3f} px.\n"
            f"Blue: inside a board at least once, {100 * calibration.coverage:.0f} % of the image.",
        )
        _residuals(_image(axes_at(drawn, (MARGIN, HEAD, wide, wide * shape)), camera), calibration, factor)
        seen = calibration.views[name][np.isfinite(calibration.views[name]).all(axis=1)]
        taken = ("as photographed", photograph, seen)
        straight = ("undistorted", undistorted(photograph, camera), camera.undistort(seen))
        for number, (title, image, corners) in enumerate((taken, straight)):
            axes = axes_at(drawn, (MARGIN + number * (half + GAP), below, half, half * shape))
            _image(axes, camera).imshow(image, cmap="gray", vmin=0, vmax=255, interpolation="antialiased")
            axes.plot(*corners.T, ".", ms=1.5, color=MEASURED)
            axes.set_title(f"{Path(name).name} {title}", size=SMALL, color=MUTED, pad=3)
    return drawn


def undistorted(image: NDArray[np.uint8], camera: Camera) -> NDArray[np.uint8]:
    """The image of a pinhole camera with the same matrix, to look at, not to measure in."""
    height, width = image.shape[:2]
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2)
    places = camera.distort(pixels).astype(np.float32).reshape(height, width, 2)
    straight = cv2.remap(image, places, np.empty(0), cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    return np.asarray(straight, dtype=np.uint8)


def _residuals(axes: Axes, calibration: Calibration, factor: float) -> None:
    for seen in calibration.views.values():
        corners = seen[np.isfinite(seen).all(axis=1)].astype(np.float32)
        axes.add_patch(Polygon(cv2.convexHull(corners)[:, 0], fc=COVERED, alpha=0.12, lw=0))
    corners, residuals = _all(calibration.views.values()), _all(calibration.residuals.values())
    ends = corners - factor * residuals
    lines = np.stack([corners, ends, np.full_like(ends, np.nan)], axis=1).reshape(-1, 2)
    axes.plot(*lines.T, color=INK, lw=0.5)
    axes.plot(*corners.T, ".", ms=1.2, color=MEASURED)


def _image(axes: Axes, camera: Camera) -> Axes:
    """Axes in pixels, y down, with a frame only."""
    axes.set(xlim=(-0.5, camera.width - 0.5), ylim=(camera.height - 0.5, -0.5), xticks=[], yticks=[])
    axes.spines[:].set_visible(True)
    return axes


def _all(arrays: Iterable[FloatArray]) -> FloatArray:
    return np.concatenate(list(arrays))


def _round(factor: float) -> float:
    """The factor rounded down to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(factor))
    return float(power * max(digit for digit in (1, 2, 5) if digit * power <= factor))

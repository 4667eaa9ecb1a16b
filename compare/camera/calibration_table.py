"""A calibration as a table for the terminal."""

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from vision.calibration.camera_calibration import Calibration


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
    table.add_row("photographs with the board", f"{seen} of {seen + len(calibration.boardless)}", "", "")
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

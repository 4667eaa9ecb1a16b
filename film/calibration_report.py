"""A calibration to check: a table of intrinsics and errors."""

from rich.box import SIMPLE_HEAD
from rich.table import Table

from pinnray.vision.calibration.camera import INTRINSICS
from pinnray.vision.calibration.camera_calibration import Calibration


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

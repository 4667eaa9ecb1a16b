"""Calibrate a camera."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.console import Console

from compare.exits import say
from compare.options import OUTPUT
from compare.provenance import package_versions
from geometry.errors import UserError


def calibrate(
    *images: Annotated[Path, Parameter(help="Photographs of the board, all of one size.")],
    board: Annotated[str, Parameter(help="Inner corners along either side, such as 9x6.")],
    square: Annotated[float, Parameter(help="Side of a square, mm.")],
    k3: Annotated[
        bool, Parameter(negative="", help="Fit the third radial coefficient too, for a wide lens.")
    ] = False,
    out: Annotated[Path, Parameter(group=OUTPUT, help="The camera, JSON or YAML.")] = Path("out/camera.json"),
) -> int:
    """Calibrate a camera from photographs of a chessboard, and say how well it is known."""
    from compare.calibration_table import calibration_table
    from vision.board import read_board, read_grey
    from vision.calibration import LensChoice
    from vision.calibration import calibrate as calibrated
    from vision.camera_file import check_format, save_calibration

    check_format(out)
    if not images:
        raise UserError("no photograph was given; name at least 4 that show the board")
    chessboard = read_board(board, square)
    calibration = calibrated(
        {str(path): read_grey(path) for path in images}, chessboard, lens=LensChoice(fit_k3=k3)
    )
    save_calibration(out, calibration, package_versions())
    for name in calibration.boardless:
        say(f"warning: no board of {chessboard} inner corners was found in {name}")
    Console().print(calibration_table(calibration))
    print(out)
    return 0

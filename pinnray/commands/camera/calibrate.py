"""Calibrate a camera."""

from pathlib import Path

from rich.console import Console

from pinnray.options.shared import Flag, OutputPath
from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import say


def command(
    *images: Path,
    board: str,
    square: float,
    marker: float | None = None,
    dictionary: str = "5X5_100",
    k3: Flag = False,
    out: OutputPath = Path("out/camera.json"),
) -> int:
    """Calibrate a camera from photographs of a chessboard or a ChArUco board.

    Args:
        images: Photographs of the board, all of one size: pictures, folders, or a video.
        board: Inner corners of a chessboard along either side, such as 9x6, or squares of a ChArUco board,
            such as charuco:8x6.
        square: Side of a square, mm.
        marker: Side of a marker of a ChArUco board, mm.
        dictionary: ArUco dictionary of a ChArUco board.
        k3: Fit the third radial coefficient too.
        out: Camera file, .json.
    """
    from pinnray.camera import calibrate
    from pinnray.film.calibration_report import calibration_table

    if not images:
        raise UserError("no photograph was given; name at least 4 that show the board")
    calibration = calibrate(
        images, board, square=square, marker=marker, dictionary=dictionary, k3=k3, out=out
    )
    for reason in dict.fromkeys(calibration.left_out.values()):
        names = [name for name, said in calibration.left_out.items() if said == reason]
        say(f"warning: left out {', '.join(names)}: {reason}")
    Console().print(calibration_table(calibration))
    print(out)
    return 0

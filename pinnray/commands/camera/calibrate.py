"""Calibrate a camera."""

from pathlib import Path
from typing import Literal

from rich.console import Console

from pinnray.options.shared import Flag, OutputPath, Repeated
from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import say
from pinnray.runtime.machine import package_versions

VERSIONS = ("python", "pinn-ray", "numpy", "scipy", "opencv-python-headless")


def command(
    *images: Path,
    board: str,
    square: float,
    marker: float | None = None,
    dictionary: str = "5X5_100",
    model: Literal["brown", "fisheye"] = "brown",
    k3: Flag = False,
    without: Repeated = (),
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
        model: Lens model: brown up to about 100 degrees of view, fisheye beyond.
        k3: Fit the third radial coefficient too.
        without: Photograph to leave out; may be repeated.
        out: Camera file, .json.
    """
    from pinnray.film.calibration_report import calibration_table, draw_calibration, view_table
    from pinnray.vision.calibration.camera_calibration import better_lens, calibrate_camera
    from pinnray.vision.calibration.camera_file import check_format, save_calibration
    from pinnray.vision.calibration.charuco import parse_board
    from pinnray.vision.calibration.lens_fit import LensChoice
    from pinnray.vision.frames.sources import photographs

    check_format(out)
    if not images:
        raise UserError("no photograph was given; name at least 4 that show the board")
    chosen, lens = parse_board(board, square, marker=marker, dictionary=dictionary), LensChoice(model, k3)
    calibration = calibrate_camera(photographs(images, without=without), chosen, lens=lens)
    versions = package_versions()
    save_calibration(out, calibration, {name: versions[name] for name in VERSIONS})
    errors = calibration.view_errors
    worst = max(errors, key=errors.__getitem__)
    picture = out.with_suffix(".png")
    photograph = next(image for name, image in photographs(images, without=without) if name == worst)
    draw_calibration(calibration, worst, photograph).save(picture)
    for reason in dict.fromkeys(calibration.left_out.values()):
        names = [name for name, said in calibration.left_out.items() if said == reason]
        say(f"warning: left out {', '.join(names)}: {reason}")
    if better := better_lens(calibration, lens):
        say(f"warning: with {better[0]} the error held out would be {better[1]:.3f} px")
    console = Console()
    console.print(calibration_table(calibration))
    console.print(view_table(calibration))
    print(out)
    print(picture)
    return 0

"""Write the sheets to print for a camera."""

from pathlib import Path

from pinnray.options.shared import FingerOptions, OutputPath


def command(
    *,
    finger: FingerOptions = FingerOptions(),
    marker_plane: float = 0.0,
    board: str = "9x6",
    square: float = 8.0,
    marker: float | None = None,
    dictionary: str = "5X5_100",
    out: OutputPath = Path("out/print"),
) -> int:
    """Write the sheets to print: the fiducials around the finger, and a board to calibrate the camera with.

    fiducials.svg and board.svg are in true scale; fiducials.json is for --workspace. Examples:

    - pinnray fiducials --design slender --marker-plane 20
    - pinnray fiducials --board charuco:8x6 --square 9 --marker 7

    Args:
        marker_plane: Height of the markers above the sheet, mm.
        board: Inner corners of a chessboard along either side, or charuco: and the squares.
        square: Side of a square, mm.
        marker: Side of a marker of a ChArUco board, mm; needed for one.
        dictionary: ArUco dictionary of a ChArUco board.
        out: Output folder.
    """
    from pinnray.runtime.atomic import write_json, write_text
    from pinnray.vision.calibration.charuco import parse_board
    from pinnray.vision.rig.boards import board_svg
    from pinnray.vision.tracking.workspace import Workspace, default_workspace, workspace_svg

    design, _ = finger.read()
    chosen = parse_board(board, square, marker=marker, dictionary=dictionary)
    sheet = board_svg(chosen)
    workspace = Workspace(**{**default_workspace(design).model_dump(), "marker_plane": marker_plane})
    write_text(out / "fiducials.svg", workspace_svg(workspace, design))
    write_json(out / "fiducials.json", workspace.model_dump(mode="json"))
    write_text(out / "board.svg", sheet)
    print(out / "fiducials.svg", out / "fiducials.json", out / "board.svg", sep="\n")
    return 0

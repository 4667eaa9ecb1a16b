"""Boards from text: 9x6 is a chessboard by its inner corners, charuco:8x6 a ChArUco board by its squares."""

import re

from geometry.errors import UserError
from vision.calibration.charuco import CharucoBoard
from vision.calibration.chessboard import Board


def parse_board(
    text: str, square: float, *, marker: float | None = None, dictionary: str = "5X5_100"
) -> Board:
    """The board that a text names; sides of its squares and, for ChArUco, of its markers in mm.

    Raises:
        UserError: If the text names no possible board.
    """
    if not (found := re.fullmatch(r"(charuco:)?(\d{1,3})x(\d{1,3})", text.strip(), re.IGNORECASE)):
        raise UserError(
            f"cannot read the board {text!r}; give its inner corners, such as 9x6, or the squares of a "
            "ChArUco board, such as charuco:8x6"
        )
    columns, rows = int(found[2]), int(found[3])
    if not found[1]:
        if marker is not None:
            raise UserError(f"the chessboard {text} has no markers; for a ChArUco board give charuco:{text}")
        return Board(columns, rows, square)
    if marker is None:
        raise UserError(f"the board {text} has markers; give their side in mm by --marker")
    name = dictionary.upper().removeprefix("DICT_")
    return CharucoBoard(columns - 1, rows - 1, square, marker, name)

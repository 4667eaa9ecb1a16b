"""A chessboard to calibrate with, and its corners in a photograph."""

import re
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from geometry.arrays import BoolArray, FloatArray
from geometry.errors import UserError

GreyImage = NDArray[np.uint8]


@dataclass(frozen=True)
class Board:
    """A chessboard.

    Attributes:
        columns, rows: Inner corners, where four squares meet, along either side.
        square: Side of a square, mm.

    Raises:
        UserError: If there are fewer than 3 corners along a side, or the square has no size.
    """

    columns: int
    rows: int
    square: float

    def __post_init__(self) -> None:
        if min(self.columns, self.rows) < 3 or max(self.columns, self.rows) > 100:
            raise UserError(f"a board of {self} inner corners; it must have 3 to 100 along either side")
        if not 0 < self.square < np.inf:
            raise UserError(f"a square of {self.square:g} mm; its side must be above zero")

    def __str__(self) -> str:
        return f"{self.columns}x{self.rows}"

    @property
    def corners(self) -> FloatArray:
        """The inner corners in the board's frame, row by row, shape (columns * rows, 3), mm."""
        rows, columns = np.mgrid[: self.rows, : self.columns]
        corners = np.stack([columns.ravel(), rows.ravel(), np.zeros(rows.size)], axis=1)
        return np.asarray(self.square * corners, dtype=np.float64)

    @property
    def halves(self) -> tuple[BoolArray, BoolArray]:
        """The corners in two halves that interlock like the squares of a board, shape (n,) each."""
        first = np.indices((self.rows, self.columns)).sum(axis=0).ravel() % 2 == 0
        return first, ~first

    def find(self, image: GreyImage) -> FloatArray | None:
        """Where `corners` are in an image, shape (n, 2), pixels; None if it does not show the whole board.

        Source: A. Duda, U. Frese, "Accurate detection and localization of checkerboard corners for
        calibration", BMVC 2018, as in OpenCV.
        """
        found, corners = cv2.findChessboardCornersSB(
            image, (self.columns, self.rows), flags=cv2.CALIB_CB_ACCURACY
        )
        return np.asarray(corners, dtype=np.float64).reshape(-1, 2) if found else None


def read_board(size: str, square: float) -> Board:
    """The board of a text such as "9x6" and the side of a square, mm."""
    if not (found := re.fullmatch(r"(\d{1,3})x(\d{1,3})", size.strip(), re.IGNORECASE)):
        raise UserError(f"cannot read the board {size!r}; give its inner corners, such as 9x6")
    return Board(int(found[1]), int(found[2]), square)


def read_grey(path: Path) -> GreyImage:
    """A picture in grey, not turned even if its file says how, shape (height, width).

    Raises:
        UserError: If there is no such file or it is no picture.
    """
    try:
        content = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    except OSError as error:
        raise UserError(f"cannot read the picture {path}: {error.strerror}") from None
    flags = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION
    image = cv2.imdecode(content, flags) if len(content) else None
    if image is None:
        raise UserError(
            f"cannot read the picture {path}: it is not one that OpenCV knows, such as PNG or JPEG"
        )
    return np.asarray(image, dtype=np.uint8)

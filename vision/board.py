"""A chessboard to calibrate with, and its corners in a photograph."""

from dataclasses import dataclass

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
            raise UserError(
                f"a board of {self.columns}x{self.rows} inner corners; either side must have 3 to 100"
            )
        if not 0 < self.square < np.inf:
            raise UserError(f"a square of {self.square:g} mm; its side must be above zero")

    def __str__(self) -> str:
        return f"{self.columns}x{self.rows} inner corners"

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

    def seems(self, image: GreyImage) -> str | None:
        """Another size that the board in an image seems to have; None if there is none."""
        found, _, cells = cv2.findChessboardCornersSBWithMeta(image, (3, 3), cv2.CALIB_CB_LARGER)
        return f"{max(cells.shape)}x{min(cells.shape)}" if found else None

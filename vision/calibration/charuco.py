"""ChArUco boards: chessboards with a marker in every white square, any part of which may be seen."""

import re
from dataclasses import dataclass
from itertools import product

import cv2
import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.calibration.chessboard import Board
from pinnray.vision.frames.frame import GreyImage

MARKER_FREE = 0.6
"""Radius around a corner without markers, over the difference of the sides of square and marker."""
DICTIONARIES = {
    name.removeprefix("DICT_"): int(getattr(cv2.aruco, name))
    for name in sorted(dir(cv2.aruco))
    if name.startswith("DICT_") and name == name.upper()
}


@dataclass(frozen=True)
class CharucoBoard(Board):
    """A ChArUco board.

    Attributes:
        columns, rows: Inner corners along either side, one less than squares.
        square: Side of a square, mm.
        marker: Side of a marker, mm.
        dictionary: Of its markers, a name in `DICTIONARIES`.

    Raises:
        UserError: As a chessboard, and if a marker has no room in a square, or the dictionary is
            not known or too small.
    """

    marker: float
    dictionary: str

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.marker < self.square:
            raise UserError(
                f"a marker of {self.marker:g} mm in a square of {self.square:g} mm; it must be above zero "
                "and smaller than the square"
            )
        if self.dictionary not in DICTIONARIES:
            raise UserError(
                f"no dictionary of markers is called {self.dictionary!r}; there are: "
                f"{', '.join(DICTIONARIES)}"
            )
        markers = (self.columns + 1) * (self.rows + 1) // 2
        size = len(cv2.aruco.getPredefinedDictionary(DICTIONARIES[self.dictionary]).bytesList)
        if markers > size:
            raise UserError(f"{self} has {markers} markers, but the dictionary only {size}")

    def __str__(self) -> str:
        return f"{self.columns + 1}x{self.rows + 1} squares with markers {self.dictionary}"

    def find(self, image: GreyImage) -> FloatArray | None:
        """Find `corners` in an image, shape (n, 2), pixels, NaN where one is not seen; None if all are.

        Boards of the layout before OpenCV 4.6, and those that are printed white on black, are found, too.

        Source: S. Garrido-Jurado et al., "Automatic generation and detection of highly reliable fiducial
        markers under occlusion", Pattern Recognition 47, 2014, as in OpenCV,
        which before 4.14 puts corners half a pixel to the right and below; then
        `pinnray.vision.calibration.corner_refinement`.
        """
        settings = cv2.aruco.CharucoParameters()
        settings.tryRefineMarkers = True  # looks for missing markers where the others say they are
        for negative, legacy in product((False, True), repeat=2):
            board, shown = self.opencv(legacy=legacy), cv2.bitwise_not(image) if negative else image
            pixels, numbers, _, _ = cv2.aruco.CharucoDetector(board, settings).detectBoard(shown)
            if numbers is not None and len(numbers):
                break
        else:
            return None
        corners = np.full((len(self.corners), 2), np.nan)
        corners[np.ravel(numbers)] = np.reshape(pixels, (-1, 2))
        return self.refine(image, corners, MARKER_FREE * (self.square - self.marker))

    def opencv(self, *, legacy: bool) -> cv2.aruco.CharucoBoard:
        """OpenCV's object, with its layout before version 4.6 if it is `legacy`."""
        size, dictionary = (self.columns + 1, self.rows + 1), DICTIONARIES[self.dictionary]
        markers = cv2.aruco.getPredefinedDictionary(dictionary)
        board = cv2.aruco.CharucoBoard(size, self.square, self.marker, markers)
        board.setLegacyPattern(legacy)
        return board


def parse_board(
    text: str, square: float, *, marker: float | None = None, dictionary: str = "5X5_100"
) -> Board:
    """Parse the name of a board; sides in mm.

    9x6 is a chessboard by inner corners, and charuco:8x6 a ChArUco board by squares.

    Raises:
        UserError: If the text names no possible board.
    """
    if not (found := re.fullmatch(r"(charuco:)?(\d{1,3})x(\d{1,3})", text.strip(), re.I)):
        raise UserError(
            f"cannot read the board {text!r}; give its inner corners, such as 9x6, or the squares of a "
            "ChArUco board, such as charuco:8x6"
        )
    columns, rows = int(found[2]), int(found[3])
    if not found[1]:
        if marker is not None:
            raise UserError(f"the board {text} has no markers; for a ChArUco board give charuco:{text}")
        return Board(columns, rows, square)
    if marker is None:
        raise UserError(f"the board {text} has markers; give their side in mm")
    name = dictionary.upper().removeprefix("DICT_")
    return CharucoBoard(columns - 1, rows - 1, square, marker, name)

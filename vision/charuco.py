"""A ChArUco board: a chessboard with a marker in every white square, of which any part may be seen."""

from dataclasses import dataclass

import cv2
import numpy as np

from geometry.arrays import BoolArray, FloatArray, IntArray
from geometry.errors import UserError
from vision.board import Board, GreyImage

FEWEST_CORNERS = 4
"""In either half of the corners: as many as determine a pose."""
SMALLEST_WINDOW, LARGEST_WINDOW = 2, 8
"""Half the side of the square in which a corner is sought, pixels."""
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
        UserError: Besides what a chessboard refuses, if a marker has no room in a square, the dictionary is
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
        """Where `corners` are in an image, shape (n, 2), pixels, NaN where one is not seen; None if few are.

        OpenCV before 4.14 gives them half a pixel off; they are located anew as saddle points, in windows
        that end where the markers begin. Boards of the layout before OpenCV 4.6 are found too.

        Source: S. Garrido-Jurado et al., "Automatic generation and detection of highly reliable fiducial
        markers under occlusion", Pattern Recognition 47, 2014; W. Förstner, E. Gülch, "A fast operator for
        detection and precise location of distinct points, corners and centres of circular features", 1987;
        both as in OpenCV.
        """
        for legacy in (False, True):
            board = self._opencv(legacy=legacy)
            pixels, numbers, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(image)
            if numbers is not None and len(numbers):
                break
        else:
            return None
        corners = np.full((len(self.corners), 2), np.nan)
        half = self._window(np.ravel(numbers), np.reshape(pixels, (-1, 2)))
        stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-4)
        pixels = np.asarray(pixels, dtype=np.float32)
        corners[np.ravel(numbers)] = np.reshape(
            cv2.cornerSubPix(image, pixels, (half, half), (-1, -1), stop), (-1, 2)
        )
        return corners if self._determined(np.isfinite(corners[:, 0])) else None

    def seems(self, image: GreyImage) -> str | None:
        """Nothing: the markers are counted by name."""
        return None

    def _opencv(self, *, legacy: bool) -> cv2.aruco.CharucoBoard:
        board = cv2.aruco.CharucoBoard(
            (self.columns + 1, self.rows + 1),
            self.square,
            self.marker,
            cv2.aruco.getPredefinedDictionary(DICTIONARIES[self.dictionary]),
        )
        board.setLegacyPattern(legacy)
        return board

    def _window(self, numbers: IntArray, pixels: FloatArray) -> int:
        """Half the side of a window that does not reach the markers, pixels."""
        apart = np.linalg.norm(pixels[:, None] - pixels, axis=2)
        neighbours = np.linalg.norm(self.corners[numbers][:, None] - self.corners[numbers], axis=2)
        side = np.min(apart[np.isclose(neighbours, self.square)], initial=np.inf)
        gap = 0.5 * side * (1 - self.marker / self.square)
        return int(np.clip(gap, SMALLEST_WINDOW, LARGEST_WINDOW))

    def _determined(self, seen: BoolArray) -> bool:
        """Whether either half of the seen corners determines a pose."""
        for half in self.halves:
            points = self.corners[half & seen, :2]
            if len(points) < FEWEST_CORNERS:
                return False
            spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
            if spread[1] < 0.1 * spread[0]:
                return False
        return True

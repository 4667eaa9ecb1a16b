"""Chessboards for calibration, and the search for their corners in a photograph."""

from dataclasses import dataclass

import cv2
import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.calibration.corner_refinement import refine_corners
from pinnray.vision.frames.frame import GreyImage

EDGE = 0.45
"""Radius around a corner in which only its own two edges lie, over a square's side."""
SMALLEST_SQUARE, LARGEST_SQUARE = 0.2, 1000.0
"""Range of the side of a square, mm. Below it the side is in metres: nobody prints a board so fine."""
RADII = (2.5, 12.0)
"""Smallest and largest radius of the pixels that a corner is fitted to."""
LARGE = 1600
"""Longer side of an image, pixels, above which corners are first searched in a smaller one."""
SEARCHES = (1, 2)
"""Factors by which an image is shrunk until a board is found: the smaller image sharpens a blurred board."""
LEAST_RANK = 0.01
"""Eighth singular value of a homography's equations over the first, below which points do not determine it.

It is 0 for three of four points on a line, 0.36 for a square, and 0.03 for two rows of 30.
"""


@dataclass(frozen=True)
class Board:
    """A chessboard.

    Attributes:
        columns, rows: Inner corners, where four squares meet, along either side.
        square: Side of a square, mm.

    Raises:
        UserError: If there are fewer than 3 corners along a side, or the square is
            smaller or larger than any board's.
    """

    columns: int
    rows: int
    square: float

    def __post_init__(self) -> None:
        if min(self.columns, self.rows) < 3 or max(self.columns, self.rows) > 100:
            raise UserError(
                f"a board of {self.columns}x{self.rows} inner corners; either side must have 3 to 100"
            )
        if not SMALLEST_SQUARE <= self.square <= LARGEST_SQUARE:
            metres = "; this looks like metres, give mm" if 0 < self.square < SMALLEST_SQUARE else ""
            raise UserError(
                f"a square of {self.square:g} mm; its side must be {SMALLEST_SQUARE:g} to {LARGEST_SQUARE:g} "
                f"mm{metres}"
            )

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
        """Find `corners` in an image, shape (n, 2), pixels; None if it does not show the whole board.

        Source: A. Duda, U. Frese, "Accurate detection and localization of checkerboard corners for
        calibration", BMVC 2018, as in OpenCV; then `pinnray.vision.calibration.corner_refinement`.
        """
        size, flags = (self.columns, self.rows), cv2.CALIB_CB_ACCURACY
        for factor in SEARCHES:
            shrink = factor * max(1.0, max(image.shape) / LARGE)
            width, height = (round(side / shrink) for side in image.shape[::-1])
            small = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
            found, corners = cv2.findChessboardCornersSB(small, size, flags=flags)
            if found:
                break
        else:
            return None
        scale = np.divide(image.shape[::-1], small.shape[::-1])
        guesses = (np.reshape(corners, (-1, 2)).astype(np.float64) + 0.5) * scale - 0.5
        refined = self.refine(image, guesses, EDGE * self.square)
        seen = np.isfinite(refined[:, 0]).reshape(self.rows, self.columns)
        # OpenCV adds rows to smaller boards.
        return refined if seen.any(axis=0).all() and seen.any(axis=1).all() else None

    def refine(self, image: GreyImage, corners: FloatArray, reach: float) -> FloatArray:
        """Refine corners to hundredths of a pixel, shape (n, 2) with NaN where one is not seen.

        Corners that do not determine a pose stay as they are.

        Args:
            image: Of the board.
            corners: Guesses, shape (n, 2), pixels.
            reach: Radius around a corner in which the board shows only its two edges, mm.
        """
        seen = np.isfinite(corners[:, 0])
        if not self.determines_pose(seen):
            return corners
        homography, _ = cv2.findHomography(self.corners[seen, :2], corners[seen])
        edges = homography_jacobian(np.asarray(homography, np.float64), self.corners[seen, :2])
        lengths = np.linalg.norm(edges, axis=2)
        narrowest = np.abs(np.linalg.det(edges)) / lengths.max(axis=1)
        radii = np.clip(reach * narrowest, *RADII)
        refined = np.full_like(corners, np.nan)
        refined[seen] = refine_corners(image, corners[seen], edges, radii)
        return refined

    def determines_pose(self, seen: BoolArray) -> bool:
        """True if the seen corners, shape (n,), determine a homography: four of them, no three on a line.

        Source: R. Hartley, A. Zisserman, "Multiple View Geometry", 2nd ed., 2003, section 4.1.3, for points
        that stay where they are.
        """
        points = self.corners[seen, :2]
        if len(points) < 4:
            return False
        points = points - points.mean(axis=0)
        points /= np.sqrt((points**2).mean())
        whole = np.column_stack([points, np.ones(len(points))])
        none = np.zeros_like(whole)
        equations = [[whole, none, -points[:, :1] * whole], [none, whole, -points[:, 1:] * whole]]
        values = np.linalg.svd(np.block(equations), compute_uv=False)
        return bool(values[7] >= LEAST_RANK * values[0])


def homography_jacobian(homography: FloatArray, points: FloatArray) -> FloatArray:
    """Derivative of a homography by x and y, in rows, shape (n, 2, 2), at points, shape (n, 2)."""
    places = np.column_stack([points, np.ones(len(points))]) @ homography.T
    pixels = places[:, :2] / places[:, 2:]
    jacobian = homography[:2, :2].T - homography[2, :2][:, None] * pixels[:, None, :]
    return np.asarray(jacobian / places[:, 2, None, None])

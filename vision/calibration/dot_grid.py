"""Grids of dots for calibration, dark on light or light on dark: symmetric, or with shifted rows."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.vision.calibration.chessboard import Board, homography_jacobian
from pinnray.vision.frames.frame import GreyImage

SMALLEST_DOT = 20.0
"""Area of a dot, pixels."""


@dataclass(frozen=True)
class DotGrid(Board):
    """A grid of dots; `corners` are the centres.

    Attributes:
        columns, rows: Dots in a row, and rows.
        square: Distance between rows, mm; of a symmetric grid also that between the dots of a row, of an
            asymmetric one half of it, as in OpenCV.
        asymmetric: Whether every other row is shifted by `square`.

    Raises:
        UserError: As a chessboard.
    """

    asymmetric: bool = False

    def __str__(self) -> str:
        return f"{self.columns}x{self.rows} dots{' in shifted rows' if self.asymmetric else ''}"

    @property
    def corners(self) -> FloatArray:
        """The centres in the board's frame, row by row, shape (columns * rows, 3), mm."""
        corners = super().corners
        if self.asymmetric:
            shifted = np.rint(corners[:, 1] / self.square) % 2
            corners[:, 0] = 2 * corners[:, 0] + self.square * shifted
        return corners

    def find(self, image: GreyImage) -> FloatArray | None:
        """Find the centres in an image, shape (n, 2), pixels; None if it does not show the whole grid."""
        kind = cv2.CALIB_CB_ASYMMETRIC_GRID if self.asymmetric else cv2.CALIB_CB_SYMMETRIC_GRID
        for colour in (0, 255):
            settings = cv2.SimpleBlobDetector.Params()
            settings.blobColor = colour
            settings.minArea, settings.maxArea = SMALLEST_DOT, image.size / (2 * self.columns * self.rows)
            settings.minDistBetweenBlobs = 2 * (SMALLEST_DOT / np.pi) ** 0.5
            detector = cv2.SimpleBlobDetector.create(settings)
            for flags in (kind, kind | cv2.CALIB_CB_CLUSTERING):
                found, seen = cv2.findCirclesGrid(
                    image, (self.columns, self.rows), flags=flags, blobDetector=detector
                )
                if found:
                    blobs = detector.detect(image)
                    return self._of_circles(np.reshape(seen, (-1, 2)).astype(np.float64), blobs)
        return None

    def _of_circles(self, seen: FloatArray, blobs: Sequence[cv2.KeyPoint]) -> FloatArray:
        """Centres of circles, shape (n, 2), pixels, from those of their images, which perspective moves.

        Source: J. Heikkilä, "Geometric camera calibration using circular control points", IEEE TPAMI 22,
        2000, by the dual conics of the circles.
        """
        points = self.corners[:, :2]
        homography = np.asarray(cv2.findHomography(points, seen)[0], np.float64)
        if np.linalg.det(homography) < 0 and not self.asymmetric:  # OpenCV took the mirror image
            seen = seen.reshape(self.rows, self.columns, 2)[:, ::-1].reshape(-1, 2)
            homography = np.asarray(cv2.findHomography(points, seen)[0], np.float64)
        places = np.array([blob.pt for blob in blobs])
        nearest = np.linalg.norm(places - seen[:, None], axis=2).argmin(axis=1)
        areas = np.abs(np.linalg.det(homography_jacobian(homography, points)))
        sizes = np.array([blobs[number].size / 2 for number in nearest])
        radius = float(np.median(sizes / np.sqrt(areas)))
        whole = np.column_stack([points, np.ones(len(points))])
        circles = whole[:, :, None] * whole[:, None] - radius**2 * np.diag([1.0, 1.0, 0.0])
        ellipses = homography @ circles @ homography.T
        straight = whole @ homography.T
        moved = ellipses[:, :2, 2] / ellipses[:, 2:, 2] - straight[:, :2] / straight[:, 2:]
        return np.asarray(seen - moved)

    def suggest(self, image: GreyImage) -> str | None:
        """None: OpenCV finds only grids whose size is known."""
        return None

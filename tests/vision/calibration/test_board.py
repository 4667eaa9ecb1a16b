"""The board's corners against an analytic picture of it."""

import cv2
import numpy as np

from pinnray.vision.calibration.chessboard import Board
from tests.vision.calibration.chessboards import drawn

SMALL = Board(5, 4, 10.0)
TO_PIXELS = np.array([[4.2, 0.7, 90.0], [-0.5, 3.9, 75.0], [1e-3, -6e-4, 1.0]])
"""From the board's plane, mm."""


def test_corners_are_found_where_they_are():
    image = drawn(SMALL, np.linalg.inv(TO_PIXELS), (360, 260))
    found = SMALL.find(image)
    exact = np.column_stack([SMALL.corners[:, :2], np.ones(20)]) @ TO_PIXELS.T
    exact = exact[:, :2] / exact[:, 2:]
    error = min(np.abs(order - exact).max() for order in (found, found[::-1]))  # a board has no up
    assert error < 0.02  # 0.06 without the fit of `pinnray.vision.calibration.corner_refinement`
    assert Board(6, 4, 10.0).find(image) is None


def test_corners_of_a_large_image_are_sought_in_a_smaller_one():
    image = drawn(SMALL, np.linalg.inv(TO_PIXELS), (360, 260))
    large = cv2.GaussianBlur(cv2.resize(image, None, fx=5, fy=5, interpolation=cv2.INTER_NEAREST), (0, 0), 2)
    found, expected = SMALL.find(large), 5 * SMALL.find(image) + 2
    error = min(np.abs(order - expected).max() for order in (found, found[::-1]))
    assert error < 0.4  # of larger pixels, in whose steps the edges are

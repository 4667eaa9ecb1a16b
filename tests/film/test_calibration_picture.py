"""The picture of a calibration, and the image without distortion in it."""

import cv2
import numpy as np

from pinnray.film.calibration_report import draw_calibration, undistorted
from pinnray.vision.calibration.camera import Camera
from pinnray.vision.calibration.camera_calibration import Calibration
from pinnray.vision.calibration.chessboard import Board
from tests.compare.figures.drawn_pages import page_of
from tests.vision.calibration.chessboards import distorted

CAMERA = Camera(320, 240, 250.0, 250.0, 160.0, 120.0, distortion=(-0.3, 0.1, 0.0, 0.0, 0.0))
CORNERS = Board(5, 4, 30.0).corners[:, :2] + (90, 70)


def test_straight_lines_are_straight_again():
    straight = np.stack([np.linspace(20, 300, 600), np.full(600, 40.0)], axis=1)
    image = np.zeros((240, 320), dtype=np.uint8)
    curve = distorted(CAMERA, straight)
    assert np.ptp(curve[:, 1]) > 3
    cv2.polylines(image, [np.rint(curve * 16).astype(np.int32)], False, 255, 1, cv2.LINE_AA, shift=4)
    found = undistorted(image, CAMERA).astype(float)[:, 40:280]
    rows = (found * np.arange(240)[:, None]).sum(axis=0) / found.sum(axis=0)
    np.testing.assert_allclose(rows, 40, rtol=0, atol=0.6)  # the line was drawn to half a pixel


def test_the_picture_tells_the_errors_and_leaves_nothing_outside():
    rng = np.random.default_rng(0)
    views = {f"photos/{name}.png": distorted(CAMERA, CORNERS) for name in "ab"}
    views["photos/a.png"][3] = np.nan
    residuals = {name: rng.normal(0, 0.1, view.shape) + 0 * view for name, view in views.items()}
    found = Calibration(CAMERA, Board(5, 4, 30.0), views, residuals, held_out_rms=0.2345, coverage=0.5)
    drawn = draw_calibration(found, "photos/a.png", np.full((240, 320), 128, np.uint8))
    page = page_of(drawn)
    assert "held out 0.234 px" in page.text
    assert page.cut_off() == page.overlaps() == []
    assert len(drawn._repr_png_()) > 10_000

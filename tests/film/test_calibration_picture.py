"""The picture of a calibration."""

import numpy as np
import pytest

from pinnray.film.calibration_report import draw_calibration
from pinnray.vision.calibration.camera import Camera
from pinnray.vision.calibration.camera_calibration import Calibration
from pinnray.vision.calibration.chessboard import Board
from tests.compare.figures.drawn_pages import page_of, printed
from tests.vision.calibration.chessboards import distorted

CAMERA = Camera(320, 240, 250.0, 250.0, 160.0, 120.0, distortion=(-0.3, 0.1, 0.0, 0.0, 0.0))
CORNERS = Board(5, 4, 30.0).corners[:, :2] + (90, 70)


def test_the_picture_tells_the_errors_and_leaves_nothing_outside():
    rng = np.random.default_rng(0)
    views = {f"photos/{name}.png": distorted(CAMERA, CORNERS) for name in "ab"}
    views["photos/a.png"][3] = np.nan
    residuals = {name: rng.normal(0, 0.1, view.shape) + 0 * view for name, view in views.items()}
    found = Calibration(CAMERA, Board(5, 4, 30.0), views, residuals, held_out_rms=0.2345, coverage=0.5)
    drawn = draw_calibration(found)
    page = page_of(drawn)
    assert "held out 0.234 px" in page.text
    assert page.cut_off() == page.overlaps() == []
    assert printed(drawn) == (pytest.approx(85, abs=0.01), 8.1)
    assert len(drawn._repr_png_()) > 10_000

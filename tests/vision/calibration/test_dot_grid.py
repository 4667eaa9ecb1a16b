"""Grids of dots against exact pictures of them, black on white and white on black."""

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from pinnray.runtime.arrays import FloatArray
from pinnray.vision.calibration.camera_calibration import calibrate_views
from pinnray.vision.calibration.charuco import parse_board
from pinnray.vision.calibration.dot_grid import DotGrid
from pinnray.vision.frames.frame import GreyImage

SIZE, FOCAL, SAMPLES = (640, 480), 700.0, 2
CIRCLES, SHIFTED = DotGrid(7, 6, 10.0), DotGrid(4, 11, 7.5, asymmetric=True)
TILTS = [(30, 10, 20), (10, -40, 185)]
pytestmark = pytest.mark.filterwarnings("ignore:the boards cover")


def photographed(
    board: DotGrid, angles: tuple[float, ...], *, radius: float = 3.0, negative: bool = False
) -> tuple[GreyImage, FloatArray]:
    """A picture by a pinhole, and the dots' centres in it."""
    turn = Rotation.from_euler("xyz", angles, degrees=True)
    shift = np.array([0, 0, 190.0]) - turn.apply(board.corners.mean(axis=0))
    matrix = np.array([[FOCAL, 0, (SIZE[0] - 1) / 2], [0, FOCAL, (SIZE[1] - 1) / 2], [0, 0, 1]])
    to_pixels = matrix @ np.column_stack([turn.as_matrix()[:, :2], shift])
    y, x = (np.mgrid[: SIZE[1] * SAMPLES, : SIZE[0] * SAMPLES] + 0.5) / SAMPLES - 0.5
    places = np.column_stack([x.ravel(), y.ravel(), np.ones(x.size)]) @ np.linalg.inv(to_pixels).T
    places = places[:, :2] / places[:, 2:]
    centres = board.corners[:, :2]
    near = np.isfinite(cKDTree(centres).query(places, distance_upper_bound=radius)[0])
    rim = 1.5 * board.square
    sheet = ((places > centres.min(axis=0) - rim) & (places < centres.max(axis=0) + rim)).all(axis=-1)
    grey = np.where(near, 25.0, np.where(sheet, 220.0, 90.0))
    grey = grey.reshape(SIZE[1], SAMPLES, SIZE[0], SAMPLES).mean(axis=(1, 3))
    image = np.rint(cv2.GaussianBlur(grey, (0, 0), 0.8)).astype(np.uint8)
    seen = np.column_stack([centres, np.ones(len(centres))]) @ to_pixels.T
    return 255 - image if negative else image, seen[:, :2] / seen[:, 2:]


@pytest.mark.parametrize(("board", "negative"), [(CIRCLES, False), (SHIFTED, True)])
def test_centres_are_those_of_the_dots_not_of_their_images(board, negative):
    for angles in TILTS:
        image, exact = photographed(board, angles, negative=negative)
        found = board.find(image)
        errors = min((found - exact, found[::-1] - exact), key=lambda each: np.abs(each).max())
        assert np.sqrt(np.mean(errors**2)) < 0.03  # 0.1 at the centres of the images


@pytest.mark.slow
def test_a_grid_of_dots_calibrates():
    rng, views = np.random.default_rng(1), {}
    for number in range(8):
        angles = (*rng.uniform(-35, 35, 2), rng.uniform(-180, 180))
        views[str(number)] = SHIFTED.find(photographed(SHIFTED, angles)[0])
    found = calibrate_views(views, SHIFTED, SIZE)
    assert found.camera.fx == pytest.approx(FOCAL, rel=0.003)
    assert found.held_out_rms < 0.05


def test_a_part_of_a_grid_is_not_enough():
    image, exact = photographed(CIRCLES, (20, 0, 0))
    image[:, int(exact[:, 0].max()) - 20 :] = 220
    assert CIRCLES.find(image) is None
    assert SHIFTED.find(np.full((60, 80), 128, np.uint8)) is None


def test_boards_of_dots_have_names():
    assert parse_board("circles:7x6", 10) == CIRCLES
    assert parse_board("ACircles:4x11", 7.5) == SHIFTED
    assert str(SHIFTED) == "4x11 dots in shifted rows"
    np.testing.assert_allclose(SHIFTED.corners[[0, 1, 4, 8], :2], [[0, 0], [15, 0], [7.5, 7.5], [0, 15]])

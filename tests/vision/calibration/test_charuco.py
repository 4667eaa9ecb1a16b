"""ChArUco boards against exact pictures of them."""

from functools import cache

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pinnray.runtime.arrays import FloatArray
from pinnray.vision.calibration.camera import Pose
from pinnray.vision.calibration.charuco import CharucoBoard
from pinnray.vision.frames.frame import GreyImage
from tests.vision.calibration.chessboards import photographed

CHARUCO = CharucoBoard(7, 5, 20.0, 15.0, "5X5_100")
TILTS = [(20, -15, 5), (5, 30, 170)]


@cache
def picture(
    angles: tuple[float, ...], *, shift: float = 0.0, distance: float = 250.0
) -> tuple[GreyImage, FloatArray]:
    """A photograph of the board, and where its corners truly are."""
    turn = Rotation.from_euler("xyz", angles, degrees=True)
    pose = Pose(turn.as_rotvec(), np.array([shift, 0, distance]) - turn.apply((60, 40, 0)))
    return photographed(CHARUCO, pose)


@pytest.mark.slow
def test_corners_are_found_to_hundredths_of_a_pixel():
    pictures = [picture(angles) for angles in TILTS]
    errors = np.concatenate([CHARUCO.find(image) - exact for image, exact in pictures])
    assert np.sqrt(np.mean(errors**2)) < 0.013  # 0.49 by OpenCV before 4.14, 0.027 by cv2.cornerSubPix
    assert (np.abs(errors.mean(axis=0)) < 0.003).all()


@pytest.mark.slow
def test_a_part_of_the_board_is_enough():
    image, exact = picture(TILTS[0], shift=90.0)
    found = CHARUCO.find(image)
    seen = np.isfinite(found).all(axis=1)
    assert 15 < seen.sum() < 35
    np.testing.assert_allclose(found[seen], exact[seen], rtol=0, atol=0.06)


def test_a_far_board_is_found_where_single_markers_are_not():
    """Of the tilted board 12 corners or none were found without another look for the markers missed."""
    image, exact = picture((55, 10, 30), distance=500.0)
    found = CHARUCO.find(image)
    seen = np.isfinite(found).all(axis=1)
    assert seen.sum() > 25  # 33
    np.testing.assert_allclose(found[seen], exact[seen], rtol=0, atol=0.15)  # 0.09


def test_boards_of_the_layout_before_opencv_4_6_are_found():
    board = cv2.aruco.CharucoBoard((8, 6), 20, 15, cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100))
    board.setLegacyPattern(True)
    found = CHARUCO.find(board.generateImage((480, 360), marginSize=0))
    expected = CHARUCO.corners[:, :2] * 3 + 59.5  # squares of 60 pixels, the first ends at 59.5
    np.testing.assert_allclose(found, expected, rtol=0, atol=0.01)


def test_a_board_printed_white_on_black_is_found():
    image, exact = picture(TILTS[0])
    found = CHARUCO.find(255 - image)
    np.testing.assert_allclose(found, exact, rtol=0, atol=0.06)


@pytest.mark.parametrize(("covered", "usable"), [(110, True), (50, False)])
def test_a_hand_may_hide_most_of_the_board(covered, usable):
    """Some corners are found either way; whether they determine a pose is told from whether there are any."""
    image, exact = picture(TILTS[0])
    hidden = image.copy()
    hidden[:, int(exact[:, 0].min()) + covered :] = 150
    found = CHARUCO.find(hidden)
    seen = np.isfinite(found[:, 0])
    assert 0 < seen.sum() <= 14
    assert CHARUCO.determines_pose(seen) == usable

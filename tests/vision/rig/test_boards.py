"""Boards are found where they were rendered."""

import cv2
import numpy as np
import pytest

from pinnray.vision.calibration.charuco import CharucoBoard
from pinnray.vision.calibration.chessboard import Board
from pinnray.vision.rig.boards import INK, PAPER, board_poses, board_scene
from pinnray.vision.rig.exposure import Exposure
from pinnray.vision.rig.render import mean_light
from pinnray.vision.rig.virtual_camera import default_camera

CAMERA = default_camera(960, 540)
CHESS = Board(9, 6, 8.0)
CHARUCO = CharucoBoard(8, 5, 9.0, 6.3, "5X5_100")
GREY = Exposure(monochrome=True, noise=1.5)


def test_the_squares_of_a_board_leave_no_seam():
    (pose,) = board_poses(CHARUCO, CAMERA, 1, seed=1)
    light = mean_light([board_scene(CHARUCO)], CAMERA, pose, 0.0)
    assert light.min() == pytest.approx(INK[2], abs=1e-5)
    assert light.max() == pytest.approx(PAPER[1], abs=1e-5)


def test_the_poses_cover_the_image_and_show_the_whole_board():
    poses = board_poses(CHESS, CAMERA, 15)
    seen = [CAMERA.project(CHESS.corners, pose) for pose in poses]
    assert all(((pixels > 0) & (pixels < (960, 540))).all() for pixels in seen)
    everything = np.concatenate(seen)
    cells = np.unique((everything // (960 / 8, 540 / 6)).astype(int), axis=0)
    assert len(cells) > 0.85 * 48
    tilts = [np.degrees(np.arccos(cv2.Rodrigues(pose.rotation)[0][2, 2])) for pose in poses]
    assert min(tilts) > 11
    assert max(tilts) < 39

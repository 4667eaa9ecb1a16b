"""Rendered boards: their squares, their poses, and the camera that they give back."""

import cv2
import numpy as np
import pytest

from pinnray.vision.calibration.camera_calibration import calibrate_camera
from pinnray.vision.calibration.charuco import CharucoBoard
from pinnray.vision.calibration.chessboard import Board
from pinnray.vision.rig.boards import INK, PAPER, board_poses, board_scene
from pinnray.vision.rig.exposure import Exposure
from pinnray.vision.rig.render import mean_light, render
from pinnray.vision.rig.virtual_camera import default_camera

CAMERA = default_camera(960, 540)
CHESS = Board(9, 6, 8.0)
CHARUCO = CharucoBoard(8, 5, 9.0, 6.3, "5X5_100")


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


SMALL = default_camera(640, 360)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:the boards cover")
def test_the_camera_that_boards_are_rendered_with_is_recovered_within_its_standard_deviations():
    board, exposure = CharucoBoard(6, 4, 32.0, 24.0, "4X4_50"), Exposure(monochrome=True, blur=0.8, noise=2.0)
    poses = board_poses(board, SMALL, 8, seed=2)
    scene = board_scene(board)
    images = {
        str(number): render(scene, SMALL, pose, exposure, seed=2, frame=number)
        for number, pose in enumerate(poses)
    }
    found = calibrate_camera(images.items(), board)
    assert found.left_out == {}
    off = (found.camera.intrinsics - SMALL.intrinsics)[:8]
    deviations = np.array(found.camera.standard_deviations)[:8]
    assert (np.abs(off) < 3.5 * deviations).all()
    assert deviations[0] < 0.2  # pixels, 0.03 %
    assert found.held_out_rms < 0.03

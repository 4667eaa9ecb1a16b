"""From rendered photographs of a board to the camera that they were rendered with."""

import numpy as np
import pytest

from pinnray.vision.calibration.camera_calibration import calibrate_camera
from pinnray.vision.calibration.charuco import CharucoBoard
from pinnray.vision.calibration.chessboard import Board
from pinnray.vision.rig.boards import board_poses, board_scene
from pinnray.vision.rig.exposure import Exposure
from pinnray.vision.rig.render import render
from pinnray.vision.rig.virtual_camera import default_camera

pytestmark = pytest.mark.slow

CAMERA = default_camera(640, 360)
EXPOSURE = Exposure(monochrome=True, blur=0.8, noise=2.0)


@pytest.mark.filterwarnings("ignore:the boards cover")
@pytest.mark.parametrize("board", [Board(9, 6, 25.0), CharucoBoard(6, 4, 32.0, 24.0, "4X4_50")])
def test_the_camera_is_recovered_within_its_standard_deviations(board):
    poses = board_poses(board, CAMERA, 8, seed=2)
    scene = board_scene(board)
    images = {
        str(number): render(scene, CAMERA, pose, EXPOSURE, seed=2, frame=number)
        for number, pose in enumerate(poses)
    }
    found = calibrate_camera(images.items(), board)
    assert found.left_out == {}
    off = (found.camera.intrinsics - CAMERA.intrinsics)[:8]
    deviations = np.array(found.camera.standard_deviations)[:8]
    assert (np.abs(off) < 3.5 * deviations).all()
    assert deviations[0] < 0.2  # pixels, 0.03 %
    assert found.held_out_rms < 0.03

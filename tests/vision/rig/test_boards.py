"""Boards are found where they were rendered."""

import cv2
import numpy as np
import pytest

from geometry.errors import UserError
from vision.calibration.charuco import CharucoBoard
from vision.calibration.chessboard import Board
from vision.rig.boards import INK, PAPER, board_poses, board_scene
from vision.rig.exposure import Exposure
from vision.rig.render import mean_light, render
from vision.rig.virtual_camera import default_camera

CAMERA = default_camera(960, 540)
CHESS = Board(9, 6, 8.0)
CHARUCO = CharucoBoard(8, 5, 9.0, 6.3, "5X5_100")
GREY = Exposure(monochrome=True, noise=1.5)


@pytest.mark.parametrize(("board", "limit"), [(CHESS, 0.06), (CHARUCO, 0.12)])
def test_the_corners_of_a_board_are_found_where_they_are(board, limit):
    for number, pose in enumerate(board_poses(board, CAMERA, 2, seed=5)):
        image = render(board_scene(board), CAMERA, pose, GREY, seed=5, frame=number)
        found = board.find(image)
        assert found is not None
        exact = CAMERA.project(board.corners, pose)
        if np.nansum((found[0] - exact[0]) ** 2) > 100:  # a chessboard may be read from its other end
            exact = exact[::-1]
        missed = found - exact
        missed = missed[np.isfinite(missed[:, 0])]
        assert len(missed) > 0.9 * len(board.corners)
        assert np.sqrt((missed**2).sum(axis=1).mean()) < limit
        assert np.linalg.norm(missed.mean(axis=0)) < 0.02


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


def test_poses_are_the_same_for_the_same_seed():
    first, second, other = (board_poses(CHESS, CAMERA, 2, seed=seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(first[1].translation, second[1].translation)
    assert (first[1].translation != other[1].translation).all()


def test_a_board_that_does_not_fit_is_refused():
    with pytest.raises(UserError, match="does not fit"):
        board_poses(Board(3, 90, 8.0), default_camera(400, 100), 1)

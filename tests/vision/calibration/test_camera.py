"""The camera against its formula, its inverse, and its files."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from pinnray.vision.calibration.camera import INTRINSICS
from pinnray.vision.calibration.camera_file import load_camera, save_camera
from tests.vision.calibration.chessboards import BOARD, CAMERA, distorted, poses, projected

GRID = np.stack(np.meshgrid(np.linspace(0, 1279, 17), np.linspace(0, 719, 11)), axis=-1).reshape(-1, 2)
BARREL = replace(CAMERA, distortion=(-0.35, 0.15, 2e-3, -1e-3, -0.03))
KNOWN = replace(CAMERA, covariance=tuple(map(tuple, np.diag(np.pi / 10.0 ** np.arange(9)).tolist())))


@pytest.mark.parametrize("camera", [CAMERA, BARREL])
def test_points_are_seen_where_the_formula_says(camera):
    for pose in poses(3):
        expected = projected(camera, BOARD.corners, pose)
        np.testing.assert_allclose(camera.project(BOARD.corners, pose), expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("camera", [CAMERA, BARREL])
def test_undistorting_is_undone_by_distorting(camera):
    straight = camera.undistort(GRID)
    assert np.abs(straight - GRID).max() > 20  # there is something to undo
    np.testing.assert_allclose(distorted(camera, straight), GRID, rtol=0, atol=1e-9)


@pytest.mark.parametrize("camera", [CAMERA, KNOWN])
def test_a_file_gives_the_same_camera_back(camera, tmp_path):
    save_camera(tmp_path / "new" / "camera.JSON", camera)
    assert load_camera(tmp_path / "new" / "camera.JSON") == camera


def test_opencv_reads_the_file(tmp_path):
    save_camera(tmp_path / "camera.json", CAMERA)
    storage = cv2.FileStorage(str(tmp_path / "camera.json"), cv2.FILE_STORAGE_READ)
    assert storage.getNode("image_width").real() == 1280
    assert storage.getNode("camera_matrix").mat()[0].tolist() == [1100, 0, 652]
    assert storage.getNode("distortion_coefficients").mat().ravel().tolist() == list(CAMERA.distortion)


def test_four_coefficients_of_another_program_mean_that_k3_is_zero(tmp_path):
    save_camera(tmp_path / "camera.json", KNOWN)
    content = json.loads((tmp_path / "camera.json").read_text(encoding="utf-8"))
    content["distortion_coefficients"] |= {"rows": 4, "cols": 1, "data": [0.1, 0.2, 0.3, 0.4]}
    (tmp_path / "camera.json").write_text(json.dumps(content), encoding="utf-8")
    assert load_camera(tmp_path / "camera.json").distortion == (0.1, 0.2, 0.3, 0.4, 0.0)


@pytest.mark.parametrize("camera", [CAMERA, BARREL])
def test_derivatives_are_those_of_differences(camera):
    points = np.random.default_rng(2).uniform((-80, -50, 150), (80, 50, 250), (20, 3))
    steps = np.diag([1e-3] * 4 + [1e-6] * (len(INTRINSICS) - 4))

    def changed(function, step):
        up, down = (camera.with_intrinsics(camera.intrinsics + sign * step) for sign in (1, -1))
        return (function(up) - function(down)) / (2 * step.max())

    seen = camera.project_with_jacobians(points)
    for number, step in enumerate(steps):
        by_number = changed(lambda camera: camera.project(points), step)
        np.testing.assert_allclose(seen.by_intrinsics[:, :, number], by_number, rtol=1e-6, atol=1e-6)
    for axis, shift in enumerate(1e-3 * np.eye(3)):
        difference = (camera.project(points + shift) - camera.project(points - shift)) / 2e-3
        np.testing.assert_allclose(seen.by_point[:, :, axis], difference, rtol=1e-6, atol=1e-6)

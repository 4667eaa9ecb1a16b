"""The camera against its formula, its inverse, and its files."""

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from geometry.errors import UserError
from tests.vision.calibration.chessboards import BOARD, CAMERA, poses, projected
from vision.calibration.camera import Camera
from vision.calibration.camera_file import load_camera, save_camera

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
    np.testing.assert_allclose(camera.distort(straight), GRID, rtol=0, atol=1e-9)


def test_no_point_needs_no_undistorting():
    assert CAMERA.undistort(np.empty((0, 2))).shape == (0, 2)


def test_a_point_beyond_the_fold_of_the_polynomial_is_refused():
    folding = replace(CAMERA, distortion=(-0.25, 0.0, 0.0, 0.0, 0.0))  # r (1 - r²/4) ends at r = 1.155, 0.77
    with pytest.raises(UserError, match=r"cannot be undone at pixel \(1600\.0, 349\.0\)"):
        folding.undistort([[652.0, 349.0], [1600.0, 349.0]])


def test_a_point_behind_the_camera_is_refused():
    with pytest.raises(UserError, match="1 of 2 points are not in front of the camera"):
        CAMERA.project([[0, 0, 1], [0, 0, -1]])


@pytest.mark.parametrize("name", ["camera.json", "camera.yml", "new/camera.YAML"])
@pytest.mark.parametrize("camera", [CAMERA, KNOWN])
def test_a_file_gives_the_same_camera_back(camera, name, tmp_path):
    save_camera(tmp_path / name, camera)
    assert load_camera(tmp_path / name) == camera


@pytest.mark.parametrize("name", ["camera.json", "camera.yml"])
def test_opencv_reads_the_file(name, tmp_path):
    save_camera(tmp_path / name, CAMERA)
    storage = cv2.FileStorage(str(tmp_path / name), cv2.FILE_STORAGE_READ)
    assert storage.getNode("image_width").real() == 1280
    assert storage.getNode("camera_matrix").mat()[0].tolist() == [1100, 0, 652]
    assert storage.getNode("distortion_coefficients").mat().ravel().tolist() == list(CAMERA.distortion)


def test_four_coefficients_of_another_program_mean_that_k3_is_zero(tmp_path):
    content = saved(tmp_path)
    content["distortion_coefficients"] |= {"rows": 4, "cols": 1, "data": [0.1, 0.2, 0.3, 0.4]}
    (tmp_path / "camera.json").write_text(json.dumps(content), encoding="utf-8")
    assert load_camera(tmp_path / "camera.json").distortion == (0.1, 0.2, 0.3, 0.4, 0.0)


def saved(folder: Path) -> dict:
    save_camera(folder / "camera.json", KNOWN)
    return json.loads((folder / "camera.json").read_text(encoding="utf-8"))


def matrix(*data: float) -> dict:
    return {"type_id": "opencv-matrix", "rows": 1, "cols": len(data), "dt": "d", "data": list(data)}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"image_width": None}, "image_width is missing"),
        ({"image_height": "high"}, "image_height is no whole number"),
        ({"image_height": -5}, "height is -5; it must be above zero"),
        ({"camera_matrix": None}, "camera_matrix is missing; it must be a matrix of 9 numbers"),
        ({"camera_matrix": [1, 2]}, "camera_matrix is not a matrix of 9 numbers"),  # a list
        ({"camera_matrix": {"rows": 3}}, "camera_matrix is not a matrix of 9 numbers"),  # half a matrix
        ({"camera_matrix": matrix(*[0.0] * 9)}, "fx is 0; it must be above zero"),
        (
            {"distortion_coefficients": matrix(*[0.0] * 8)},
            "distortion_coefficients is not a matrix of 4 or 5",
        ),
        (
            {"intrinsics_covariance": matrix(*[1.0] * 9)},
            "intrinsics_covariance is not a matrix of 81 numbers",
        ),
        ({"intrinsics_covariance": matrix(*[-1.0] * 81)}, "its diagonal from 0: fx, fy"),
        (
            {"intrinsics_covariance": None, "intrinsics_standard_deviations": matrix(*[-1.0] * 9)},
            "a standard deviation is below zero",
        ),
        ({"fisheye_model": 1}, "distortion_coefficients is not a matrix of 4 numbers"),
    ],
)
def test_what_is_wrong_in_a_file_is_one_line(change, message, tmp_path):
    content = {key: value for key, value in (saved(tmp_path) | change).items() if value is not None}
    path = tmp_path / "camera.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(UserError, match=message) as caught:
        load_camera(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "content", [b"", b"hello", b'{"image_width": ', bytes(range(256)), b"%YAML:1.0\n---\na: ["]
)
def test_what_is_no_camera_file_is_one_line(content, tmp_path):
    path = tmp_path / "camera.yml"
    path.write_bytes(content)
    with pytest.raises(UserError, match="it is not JSON or YAML as OpenCV writes it"):
        load_camera(path)


def test_an_absent_file_is_one_line(tmp_path):
    with pytest.raises(UserError, match="No such file"):
        load_camera(tmp_path / "absent.json")


def test_other_formats_are_refused(tmp_path):
    with pytest.raises(UserError, match=r"written as \.json, \.yml, \.yaml"):
        save_camera(tmp_path / "camera.xml", CAMERA)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("change", [{"fx": np.nan}, {"distortion": (0.0,)}, {"width": 0}, {"fy": -1.0}])
def test_an_impossible_camera_is_refused(change):
    with pytest.raises(UserError):
        Camera(**{"width": 4, "height": 3, "fx": 1.0, "fy": 1.0, "cx": 2.0, "cy": 1.5} | change)


def test_every_intrinsic_has_a_name():
    assert len(KNOWN.intrinsic_names) == len(KNOWN.standard_deviations)


FISHEYE = Camera(1280, 720, 520.0, 518.0, 652.0, 349.0, (0.03, -0.01, 2e-3, -5e-4), "fisheye")


def test_a_fisheye_is_undistorted_to_the_corners():
    straight = FISHEYE.undistort(GRID)
    assert np.abs(straight - GRID).max() > 500
    np.testing.assert_allclose(FISHEYE.distort(straight), GRID, rtol=0, atol=1e-9)


@pytest.mark.parametrize("camera", [BARREL, FISHEYE])
def test_derivatives_are_those_of_differences(camera):
    points = np.random.default_rng(2).uniform((-80, -50, 150), (80, 50, 250), (20, 3))
    steps = np.diag([1e-3] * 4 + [1e-6] * (len(camera.intrinsic_names) - 4))

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


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("%YAML:1.0\n- 1\n", "it is not JSON or YAML as OpenCV writes it"),  # a list has no keys
        ('{"a": ' + "[" * 100_000 + "]" * 100_000 + "}", "it is nested too deeply"),  # ends OpenCV's reader
        ("%YAML:1.0\n---\na: " + "[" * 100_000 + "]" * 100_000, "it is nested too deeply"),
        # OpenCV's reader never ends
        ("%YAML:1.0\n---%YAML:1.0\n\ni---\nm", "it is not one YAML document as OpenCV writes it"),
        # its table of keys is broken, which OpenCV finds when it looks for the second one
        (
            f"%YAML:1.0\n---\nimage_width: 6{53 * '5'}40\nimag2_height: 480\nfisheye_model:%YA 0",
            "it is not JSON or YAML as OpenCV writes it",
        ),
    ],
)
def test_a_file_that_opencv_cannot_take_is_one_line(tmp_path, content, said):
    path = tmp_path / ("camera.json" if content[0] == "{" else "camera.yml")
    path.write_text(content)
    with pytest.raises(UserError, match=f"cannot read the camera .*: {said}"):
        load_camera(path)

"""Calibration against a camera that is known, and OpenCV's own photographs."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from chessboards import BOARD, CAMERA, drawn, views

from compare.cli import main
from geometry.errors import UserError
from vision.board import Board
from vision.calibration import LensChoice, calibrate, calibrate_views
from vision.camera_file import load_camera
from vision.photographs import photographs

SIZE = (CAMERA.width, CAMERA.height)
NOISE = 0.05
pytestmark = pytest.mark.filterwarnings("ignore:the boards cover")
PHOTOGRAPHS = sorted(Path("/usr/share/doc/opencv-doc/examples/data").glob("left[01]?.jpg"))


@pytest.fixture(scope="module")
def known():
    return calibrate_views(views(15, noise=NOISE), BOARD, SIZE)


def test_the_camera_is_recovered_within_its_standard_deviations(known):
    camera = known.camera
    found = np.array([camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion[:4]])
    true = np.array([CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy, *CAMERA.distortion[:4]])
    deviations = np.array(camera.standard_deviations[:8])
    assert deviations[0] < 1  # 0.1 %, so that the next line says something
    assert (np.abs(found - true) < 3 * deviations).all()
    assert camera.distortion[4] == camera.standard_deviations[8] == 0  # k3 is fixed


def test_standard_deviations_cover_the_errors():
    scores = []
    for seed in range(30):
        camera = calibrate_views(views(6, noise=NOISE, seed=seed), BOARD, SIZE).camera
        scores.append((camera.fx - CAMERA.fx) / camera.standard_deviations[0])
    # of 30 normal scores the root mean square lies between 0.66 and 1.37 in 99 of 100 cases
    assert 0.66 < np.sqrt(np.mean(np.square(scores))) < 1.37


def test_errors_are_those_of_the_corners(known):
    assert known.rms == pytest.approx(
        NOISE * np.sqrt(2), rel=0.08
    )  # of distances; 1,620 numbers, 98 unknowns
    assert NOISE * np.sqrt(2) < known.held_out < 1.3 * NOISE * np.sqrt(2)  # a pose from 27 corners: +11 %
    assert np.mean(np.square(list(known.view_errors.values()))) == pytest.approx(known.rms**2)


def test_held_out_errors_show_what_the_fit_hides():
    few = calibrate_views(views(4, noise=0.5), BOARD, SIZE)
    assert few.held_out > 1.1 * few.rms


def test_the_third_coefficient_is_fitted_on_request():
    camera = calibrate_views(views(8, noise=NOISE), BOARD, SIZE, lens=LensChoice(fit_k3=True)).camera
    assert 0 < abs(camera.distortion[4]) < 3 * camera.standard_deviations[8]


def test_little_coverage_warns():
    narrow = {name: pixels * 0.5 + np.array(SIZE) / 4 for name, pixels in views(5, noise=NOISE).items()}
    with pytest.warns(UserWarning, match=r"cover \d+% of the image, less than 60%"):
        assert calibrate_views(narrow, BOARD, SIZE).coverage < 0.25  # half of either side


def test_coverage_is_the_area_between_the_corners(known):
    points = np.stack(np.meshgrid(np.arange(0, 1280, 8), np.arange(0, 720, 8)), axis=-1).reshape(-1, 2)
    inside = np.zeros(len(points), dtype=bool)
    for pixels in views(15, noise=NOISE).values():
        hull = cv2.convexHull(pixels.astype(np.float32))
        inside |= [cv2.pointPolygonTest(hull, (float(x), float(y)), False) >= 0 for x, y in points]
    assert known.coverage == pytest.approx(inside.mean(), abs=0.02)


def test_too_few_views_are_refused():
    with pytest.raises(
        UserError, match=r"3 of 5 photographs show the board of 9x6 inner corners; at least 4"
    ):
        calibrate_views(views(3, noise=NOISE), BOARD, SIZE, boardless=("a", "b"))


def test_boards_that_are_never_tilted_do_not_determine_the_camera():
    flat = {str(shift): BOARD.corners[:, :2] * 3 + 40 * shift + 100 for shift in range(5)}
    with pytest.raises(UserError, match="do not determine the camera; take some with the board tilted"):
        calibrate_views(flat, BOARD, SIZE)


def test_photographs_of_different_sizes_are_refused():
    images = {"a.png": np.zeros((40, 60), np.uint8), "b.png": np.zeros((60, 40), np.uint8)}
    with pytest.raises(UserError, match=r"a\.png has 60x40 pixels and b\.png 40x60"):
        calibrate(images.items(), BOARD)


def test_photographs_without_a_board_are_refused():
    with pytest.raises(UserError, match="none of 2 photographs shows a board of 9x6"):
        calibrate(dict.fromkeys("ab", np.zeros((100, 150), np.uint8)).items(), BOARD)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Six small photographs by a pinhole with a focal length of 300 pixels, and one without a board."""
    folder, board, rng = tmp_path_factory.mktemp("photos"), Board(5, 4, 10.0), np.random.default_rng(2)
    matrix = np.array([[300.0, 0, 159.5], [0, 300, 119.5], [0, 0, 1]])
    for number in range(6):
        rotation = cv2.Rodrigues(rng.uniform(-0.6, 0.6, 3))[0]
        shift = np.array([rng.uniform(-10, 10), rng.uniform(-8, 8), 95.0]) - rotation @ (20.0, 15.0, 0.0)
        to_pixels = matrix @ np.column_stack([rotation[:, :2], shift])
        cv2.imwrite(str(folder / f"{number}.png"), drawn(board, np.linalg.inv(to_pixels), (320, 240)))
    cv2.imwrite(str(folder / "none.png"), np.zeros((240, 320), np.uint8))
    return folder


def test_the_command_goes_from_photographs_to_a_camera(folder, tmp_path, capsys):
    out = tmp_path / "camera.json"
    photographs = map(str, sorted(folder.iterdir()))
    assert main(["calibrate", *photographs, "--board", "5x4", "--square", "10", "--out", str(out)]) == 0
    printed = capsys.readouterr()
    assert "held out" in printed.out
    assert "6 of 7" in printed.out
    assert "none.png" in printed.err
    camera = load_camera(out)
    assert abs(camera.fx - 300) < 5 * camera.standard_deviations[0] < 15


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--board 5x4 --square 10", "no photograph was given"),
        ("{0}/0.png --board 5 --square 10", "cannot read the board '5'"),
        ("{0}/0.png --board 5x4", "requires an argument|square"),
        ("{0}/0.png --board 5x4 --square 10", "1 of 1 photographs show the board"),
        ("{0}/9.png --board 5x4 --square 10", "No such file"),
        ("{0}/0.png --board 5x4 --square 10 --out camera.xml", "give a name that ends so"),
    ],
)
def test_bad_input_is_one_line(arguments, message, folder, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["calibrate", *arguments.format(folder).split()]) == 2
    error = capsys.readouterr().err
    assert len(error.splitlines()) == 1
    assert re.search(message, error)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not PHOTOGRAPHS, reason="no photographs in /usr/share/doc/opencv-doc (Debian)")
def test_the_photographs_of_opencv_give_their_known_camera():
    found = calibrate(photographs(PHOTOGRAPHS), BOARD)
    assert found.boardless == ()
    assert 530 < found.camera.fx < 540
    assert abs(found.camera.fy - found.camera.fx) < 3
    assert found.rms < 0.5
    assert found.rms < found.held_out < 0.5

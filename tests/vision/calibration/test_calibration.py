"""Calibration against a camera that is known, and OpenCV's own photographs."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from pinnray.cli import main
from pinnray.runtime.errors import UserError
from pinnray.vision.calibration.camera_calibration import calibrate_camera, calibrate_views
from pinnray.vision.calibration.camera_file import load_camera
from pinnray.vision.calibration.chessboard import Board
from pinnray.vision.frames.sources import photographs
from tests.vision.calibration.chessboards import BOARD, CAMERA, drawn, views

SIZE = (CAMERA.width, CAMERA.height)
NOISE = 0.05
pytestmark = pytest.mark.filterwarnings("ignore:the boards cover")
PHOTOGRAPHS = sorted(Path("/usr/share/doc/opencv-doc/examples/data").glob("left[01]?.jpg"))


@pytest.fixture(scope="module")
def known():
    return calibrate_views(views(15, noise=NOISE), BOARD, SIZE)


def test_the_camera_is_recovered_within_its_standard_deviations(known):
    camera = known.camera
    found, true = camera.intrinsics[:8], CAMERA.intrinsics[:8]
    deviations = np.array(camera.standard_deviations[:8])
    assert deviations[0] < 1  # 0.1 %, so that the next line says something
    assert (np.abs(found - true) < 3 * deviations).all()
    assert camera.distortion[4] == camera.standard_deviations[8] == 0  # k3 is fixed


def test_errors_are_those_of_the_corners(known):
    assert known.rms == pytest.approx(
        NOISE * np.sqrt(2), rel=0.08
    )  # of distances; 1,620 numbers, 98 unknowns
    assert NOISE * np.sqrt(2) < known.held_out_rms < 1.3 * NOISE * np.sqrt(2)  # a pose from 27 corners: +11 %
    assert np.mean(np.square(list(known.view_errors.values()))) == pytest.approx(known.rms**2)


def test_the_third_coefficient_is_fitted_on_request():
    camera = calibrate_views(views(8, noise=NOISE), BOARD, SIZE, k3=True).camera
    assert 0 < abs(camera.distortion[4]) < 3 * camera.standard_deviations[8]


def test_parts_of_the_board_are_enough(known):
    rng = np.random.default_rng(3)
    parts = {}
    for name, pixels in views(15, noise=NOISE).items():
        kept = rng.choice(54, rng.integers(15, 40), replace=False)
        parts[name] = np.where(np.isin(np.arange(54), kept)[:, None], pixels, np.nan)
    found = calibrate_views(parts, BOARD, SIZE)
    off = (found.camera.intrinsics - CAMERA.intrinsics)[:8]
    assert (np.abs(off) < 3.5 * np.array(found.camera.standard_deviations[:8])).all()
    assert known.rms < found.held_out_rms < 1.6 * known.rms  # poses from half as many corners
    assert [np.isnan(part).sum() for part in parts.values()] == [
        np.isnan(residuals).sum() for residuals in found.residuals.values()
    ]


def test_a_bad_view_is_named():
    seen = views(8, noise=NOISE)
    bent = BOARD.corners[:, :1] ** 2 / 1e4  # pixels: the board was not flat
    seen["view 3"] = seen["view 3"] + bent
    with pytest.warns(UserWarning, match="view 3 has an error of"):
        calibrate_views(seen, BOARD, SIZE)


def test_coverage_is_the_area_between_the_corners(known):
    points = np.stack(np.meshgrid(np.arange(0, 1280, 8), np.arange(0, 720, 8)), axis=-1).reshape(-1, 2)
    inside = np.zeros(len(points), dtype=bool)
    for pixels in views(15, noise=NOISE).values():
        hull = cv2.convexHull(pixels.astype(np.float32))
        inside |= [cv2.pointPolygonTest(hull, (float(x), float(y)), False) >= 0 for x, y in points]
    assert known.coverage == pytest.approx(inside.mean(), abs=0.02)


GRID = BOARD.corners[:, :2] / BOARD.square


@pytest.mark.parametrize(
    "kept",
    [
        # eight, of which three of the four in one half lie on a line
        lambda x, y: (y <= 2) & (x <= 2) & ((x != 2) | (y != 0)),
        lambda x, y: (x <= 1) & (y <= 1),  # four
        lambda x, y: (x <= 4) & (y <= 1),  # two rows
        lambda x, y: ((y == 3) & (x > 0)) | ((y == 1) & (x > 6)),  # a row and two others
    ],
)
def test_a_view_of_few_corners_is_used(kept):
    """OpenCV's calibrateCamera takes such views, too."""
    seen = views(8, noise=NOISE)
    seen["view 3"] = np.where(kept(*GRID.T)[:, None], seen["view 3"], np.nan)
    found = calibrate_views(seen, BOARD, SIZE)
    assert found.left_out == {}
    assert found.camera.fx == pytest.approx(CAMERA.fx, rel=0.003)
    assert found.view_errors["view 3"] < 3 * NOISE
    assert found.held_out_rms < 2 * NOISE


@pytest.mark.parametrize(
    ("kept", "count"),
    [
        (lambda x, y: (x == 0) & (y < 3), 3),
        (lambda x, y: y == 2, 9),  # one row
        (lambda x, y: (y == 2) | ((x == 1) & (y == 4)), 10),  # and one corner beside it
        (lambda x, y: x < 0, 0),
    ],
)
def test_a_view_that_determines_no_pose_is_left_out_with_the_reason(kept, count):
    seen = views(8, noise=NOISE)
    seen["view 3"] = np.where(kept(*GRID.T)[:, None], seen["view 3"], np.nan)
    found = calibrate_views(seen, BOARD, SIZE, left_out={"a": "dark"})
    reason = f"the {count} corners that are seen are too few or lie on a line"
    assert found.left_out == {"a": "dark", "view 3": reason}
    assert "view 3" not in found.views
    assert found.camera.fx == pytest.approx(CAMERA.fx, rel=0.003)


@pytest.mark.slow
def test_boards_that_are_never_tilted_do_not_determine_the_camera():
    rng = np.random.default_rng(6)
    flat = {}
    for number in range(8):
        scale, shift = rng.uniform(2, 4), rng.uniform((0, 0), (400, 200))
        pixels = scale * BOARD.corners[:, :2] + shift
        flat[str(number)] = pixels + rng.normal(0, NOISE, pixels.shape)
    with pytest.raises(UserError, match="do not determine the camera"):
        calibrate_views(flat, BOARD, SIZE)


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


@pytest.mark.slow
def test_the_command_goes_from_photographs_to_a_camera(folder, tmp_path, capsys):
    out = tmp_path / "camera.json"
    photographs = map(str, sorted(folder.iterdir()))
    options = ["--board", "5x4", "--square", "10", "--out", str(out)]
    assert main(["calibrate", *photographs, *options]) == 0
    assert "6 of 7" in capsys.readouterr().out
    camera = load_camera(out)
    assert abs(camera.fx - 300) < 5 * camera.standard_deviations[0] < 15


@pytest.mark.skipif(not PHOTOGRAPHS, reason="no photographs in /usr/share/doc/opencv-doc (Debian)")
def test_the_photographs_of_opencv_give_their_known_camera():
    found = calibrate_camera(photographs(PHOTOGRAPHS), BOARD)
    assert found.left_out == {}
    assert 530 < found.camera.fx < 540
    assert abs(found.camera.fy - found.camera.fx) < 3
    assert found.rms < 0.2  # 0.23 without the fit of `pinnray.vision.calibration.corner_refinement`
    assert found.rms < found.held_out_rms < 0.22

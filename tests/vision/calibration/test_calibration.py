"""Calibration against a camera that is known, and OpenCV's own photographs."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geometry.errors import UserError
from pinnray.cli import main
from tests.vision.calibration.chessboards import BOARD, CAMERA, drawn, views
from vision.calibration import lens_fit
from vision.calibration.camera import Camera, Pose
from vision.calibration.camera_calibration import better_lens, calibrate_camera, calibrate_views
from vision.calibration.camera_file import load_camera
from vision.calibration.chessboard import Board
from vision.calibration.lens_fit import LensChoice
from vision.frames.sources import photographs

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


def test_errors_are_those_of_the_corners(known):
    assert known.rms == pytest.approx(
        NOISE * np.sqrt(2), rel=0.08
    )  # of distances; 1,620 numbers, 98 unknowns
    assert NOISE * np.sqrt(2) < known.held_out_rms < 1.3 * NOISE * np.sqrt(2)  # a pose from 27 corners: +11 %
    assert np.mean(np.square(list(known.view_errors.values()))) == pytest.approx(known.rms**2)


def test_held_out_errors_show_what_the_fit_hides():
    few = calibrate_views(views(4, noise=0.5), BOARD, SIZE)
    assert few.held_out_rms > 1.1 * few.rms


def test_the_third_coefficient_is_fitted_on_request():
    camera = calibrate_views(views(8, noise=NOISE), BOARD, SIZE, lens=LensChoice(fit_k3=True)).camera
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


@pytest.mark.slow
def test_a_fisheye_is_recovered_and_proposed():
    true = Camera(1280, 720, 430.0, 431.0, 645.0, 352.0, (0.03, -0.01, 2e-3, -5e-4), "fisheye")
    rng = np.random.default_rng(8)
    seen = {}
    while len(seen) < 12:
        turn = Rotation.from_euler("xyz", rng.uniform(-35, 35, 3), degrees=True)
        centre = rng.uniform((-250, -110, 120), (250, 110, 260))
        pose = Pose(turn.as_rotvec(), centre - turn.apply(BOARD.corners.mean(axis=0)))
        pixels = true.project(BOARD.corners, pose)
        if (pixels > 0).all() and (pixels < SIZE).all():
            seen[f"view {len(seen)}"] = pixels + rng.normal(0, NOISE, (54, 2))
    fisheye = LensChoice("fisheye")
    found = calibrate_views(seen, BOARD, SIZE, lens=fisheye)
    off = found.camera.intrinsics - true.intrinsics
    assert (np.abs(off) < 3.5 * np.array(found.camera.standard_deviations)).all()
    assert found.rms == pytest.approx(NOISE * np.sqrt(2), rel=0.1)
    assert better_lens(found, fisheye) is None
    brown = calibrate_views(seen, BOARD, SIZE)
    other, error = better_lens(brown, LensChoice())
    assert other == fisheye
    assert error == pytest.approx(found.held_out_rms)
    assert brown.held_out_rms > 2 * error


def test_a_board_that_is_first_taken_to_be_tilted_the_other_way_does_not_spoil_the_fit(monkeypatch):
    """The fit ended in another minimum, with residuals of 0.34 px instead of 0.29."""
    rng, count, first_guess = np.random.default_rng(2), 12, lens_fit._first_poses
    board, camera = Board(7, 5, 25.0), Camera(640, 480, 480.0, 480.0, 330.0, 235.0, (0.03, -0.1, 0, 0, 0))
    way = rng.uniform(0, 2 * np.pi, count)
    axes = np.column_stack([np.cos(way), np.sin(way), np.zeros(count)])
    turns = Rotation.from_rotvec(np.radians(rng.uniform(15, 35, count))[:, None] * axes)
    centres = rng.uniform((-120, -90, 800), (120, 90, 1000), (count, 3))
    shifts = centres - turns.apply(board.corners.mean(axis=0))
    seen = [
        camera.project(turn.apply(board.corners) + shift) + rng.normal(0, 0.3, (35, 2))
        for turn, shift in zip(turns, shifts, strict=True)
    ]

    def mirrored(*given):
        poses = first_guess(*given)
        rotations = poses.rotations.as_rotvec()
        rotations[9:10, :2] *= -1
        return poses._replace(rotations=Rotation.from_rotvec(rotations))

    right = lens_fit.fit_lens(seen, board, (640, 480), LensChoice())
    monkeypatch.setattr(lens_fit, "_first_poses", mirrored)
    again = lens_fit.fit_lens(seen, board, (640, 480), LensChoice())
    np.testing.assert_allclose(again.camera.intrinsics, right.camera.intrinsics, rtol=1e-4, atol=1e-4)


def test_a_bad_view_is_named():
    seen = views(8, noise=NOISE)
    bent = BOARD.corners[:, :1] ** 2 / 1e4  # pixels: the board was not flat
    seen["view 3"] = seen["view 3"] + bent
    with pytest.warns(UserWarning, match=r"view 3 has an error of \d\.\d+ px.*calibrate without it"):
        calibrate_views(seen, BOARD, SIZE)


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
        calibrate_views(
            views(3, noise=NOISE),
            BOARD,
            SIZE,
            left_out=dict.fromkeys("ab", "no board of 9x6 inner corners was found"),
        )


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


def test_a_view_that_is_no_image_of_a_board_is_left_out_with_the_reason():
    seen = views(8, noise=NOISE) | {"false": np.full_like(GRID, 200.0)}  # all at one pixel
    found = calibrate_views(seen, BOARD, SIZE)
    assert found.left_out == {"false": "its corners are no image of the board"}
    assert found.camera.fx == pytest.approx(CAMERA.fx, rel=0.003)


def test_a_photograph_of_few_corners_is_named():
    seen = views(6, noise=NOISE)
    seen["view 2"] = np.where((GRID[:, 1] == 0)[:, None], seen["view 2"], np.nan)
    corners = iter(seen.values())

    class Known(Board):
        def find(self, image: np.ndarray) -> np.ndarray:
            return next(corners)

    images = [(name, np.zeros(SIZE[::-1], np.uint8)) for name in seen]
    found = calibrate_camera(images, Known(9, 6, 25.0))
    assert found.left_out == {"view 2": "the 9 corners that are seen are too few or lie on a line"}


def test_too_few_views_that_remain_are_refused_with_the_reasons():
    seen = {f"{name}.png": view for name, view in views(5, noise=NOISE).items()}
    for name in ("view 1.png", "view 4.png"):
        seen[name] = np.where((GRID[:, 1] == 0)[:, None], seen[name], np.nan)
    said = (
        r"3 of 5 photographs show .*; at least 4 must, .*; view 1\.png: the 9 corners .*; view 4\.png: the 9"
    )
    with pytest.raises(UserError, match=said):
        calibrate_views(seen, BOARD, SIZE)


def test_a_camera_that_cannot_be_tested_is_refused():
    """A pose from either half needs four corners there."""
    few = {
        name: np.where((GRID.max(axis=1) <= 1)[:, None], view, np.nan)
        for name, view in views(12, noise=0).items()
    }
    with pytest.raises(
        UserError, match=r"enough corners to test the camera with|do not determine the camera"
    ):
        calibrate_views(few, BOARD, SIZE)


@pytest.mark.parametrize("noise", [0.0, 0.05, 0.5])
def test_boards_that_are_never_tilted_do_not_determine_the_camera(noise):
    rng = np.random.default_rng(6)
    flat = {}
    for number in range(8):
        scale, shift = rng.uniform(2, 4), rng.uniform((0, 0), (400, 200))
        pixels = scale * BOARD.corners[:, :2] + shift
        flat[str(number)] = pixels + rng.normal(0, noise, pixels.shape)
    with pytest.raises(UserError, match="do not determine the camera; take some with the board tilted"):
        calibrate_views(flat, BOARD, SIZE)


def test_copies_of_one_photograph_are_not_enough():
    (pixels,) = views(1, noise=NOISE).values()
    copies = {str(number): pixels for number in range(6)}
    with pytest.raises(UserError, match="do not determine the camera"):
        calibrate_views(copies, BOARD, SIZE)


def test_photographs_of_other_sizes_are_named_with_a_way_to_leave_them_out():
    upright, lying = np.zeros((60, 40), np.uint8), np.zeros((40, 60), np.uint8)
    images = {"a.png": upright, "b.png": lying, "c.png": lying, "d.png": lying, "e.png": upright}
    said = r"3 have 60x40 pixels, a\.png 40x60, e\.png 40x60; leave out a\.png, e\.png$"
    with pytest.raises(UserError, match=said):
        calibrate_camera(images.items(), BOARD)


def test_all_photographs_of_other_sizes_are_in_the_way_to_leave_them_out():
    images = {f"{number}.png": np.zeros((40, 60 if number < 9 else 50), np.uint8) for number in range(17)}
    with pytest.raises(UserError, match=r"13\.png 50x40 and 3 more; leave out ") as refused:
        calibrate_camera(images.items(), BOARD)
    _, others = str(refused.value).split("; leave out ")
    assert others.split(", ") == [f"{number}.png" for number in range(9, 17)]


@pytest.mark.parametrize(("parts", "hint"), [(2, "count them"), (5, "5 seem to show 4x3")])
def test_another_board_is_named_only_if_most_photographs_show_it(parts, hint):
    """Of a board that is hard to see OpenCV may find a part here and there."""

    class Unseen(Board):
        def find(self, image: np.ndarray) -> None:
            return None

        def suggest(self, image: np.ndarray) -> str | None:
            return "4x3" if image[0, 0] else None

    images = {str(number): np.full((9, 9), number < parts, np.uint8) for number in range(8)}
    with pytest.raises(UserError, match=f"0 of 8 photographs show the board of 9x6 inner corners; {hint}$"):
        calibrate_camera(images.items(), Unseen(9, 6, 25.0))


def test_photographs_without_a_board_are_refused():
    with pytest.raises(UserError, match="0 of 2 photographs show the board of 9x6 inner corners; count them"):
        calibrate_camera(dict.fromkeys("ab", np.zeros((100, 150), np.uint8)).items(), BOARD)


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


def test_a_photograph_can_be_left_out(folder, tmp_path, capsys):
    options = ["--board", "5x4", "--square", "10", "--without", "none.png", "--without", "1.png", "--out"]
    assert main(["calibrate", str(folder), *options, str(tmp_path / "camera.yml")]) == 0
    printed = capsys.readouterr()
    assert "5 of 5" in printed.out
    assert "1.png" not in printed.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--board 5x4 --square 10", "no photograph was given"),
        ("{0}/0.png --board 5 --square 10", "cannot read the board '5'"),
        ("{0}/0.png --board 5x4", "requires an argument|square"),
        ("{0}/0.png --board 5x4 --square 10", "1 of 1 photographs show the board"),
        ("{0}/9.png --board 5x4 --square 10", "No such file"),
        ("{0}/*.bmp --board 5x4 --square 10", "there is no such picture"),
        ("{0} --board 5x4 --square 10 --without 9.png", "there is no photograph 9.png to leave out"),
        # OpenCV's exhaustive search finds the most oblique of the six boards on some processors only.
        ("{0} --board 4x4 --square 10", "4x4 inner corners; [56] seem to show 5x4"),
        (
            "{0} --board charuco:5x4 --square 10 --marker 7",
            "0 of 7 photographs show the board of 5x4 squares",
        ),
        ("{0} --board 5x4 --square 10 --model cubic", "cubic"),
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


@pytest.mark.parametrize("model", ["brown", "fisheye"])
@pytest.mark.skipif(not PHOTOGRAPHS, reason="no photographs in /usr/share/doc/opencv-doc (Debian)")
def test_the_photographs_of_opencv_give_their_known_camera(model):
    found = calibrate_camera(photographs(PHOTOGRAPHS), BOARD, lens=LensChoice(model))
    assert found.left_out == {}
    assert 530 < found.camera.fx < 540
    assert abs(found.camera.fy - found.camera.fx) < 3
    assert found.rms < 0.2  # 0.23 without the fit of `vision.calibration.corner_refinement`
    assert found.rms < found.held_out_rms < 0.22

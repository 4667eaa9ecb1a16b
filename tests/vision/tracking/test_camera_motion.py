"""The camera's motion from fiducials that were moved by a known map or seen from another pose."""

import numpy as np
import pytest

from pinnray.runtime.arrays import FloatArray
from pinnray.vision.calibration.camera import Camera, Pose
from pinnray.vision.rig.virtual_camera import viewing_pose
from pinnray.vision.tracking.camera_motion import find_camera_motion
from pinnray.vision.tracking.scene import FilmedScene
from pinnray.vision.tracking.workspace import Workspace
from tests.fingers import beam
from tests.vision.films import CAMERA, DESIGN, WORKSPACE
from tests.vision.tracking.listed_discs import NOISE, discs_at, seen

CORNERS = ((0.0, 0.0), (100.0, 0.0), (100.0, 60.0), (0.0, 60.0), (40.0, 70.0), (110.0, 25.0))
SCENE = FilmedScene(beam(), Workspace(fiducials=CORNERS))


def pictured(places: FloatArray) -> FloatArray:
    """A tilted camera, without a lens."""
    x, y = places.T
    depth = 1 + 1e-3 * x - 5e-4 * y
    return np.column_stack([100 + 8 * x + y, 700 - 7 * y + 0.5 * x]) / depth[:, None]


def moved(pixels: FloatArray) -> FloatArray:
    """A camera that was turned a little."""
    x, y = pixels.T
    depth = 1 + 1e-6 * x + 2e-6 * y
    return np.column_stack([1.5 + x - 2e-3 * y, -0.7 + y + 2e-3 * x]) / depth[:, None]


START = pictured(SCENE.workspace.points)
BETWEEN = pictured(np.array([[20.0, 30.0], [90.0, 20.0], [50.0, 50.0]]))


def test_the_shift_is_the_median_over_the_fiducials_seen_at_both_ends() -> None:
    shifts = np.array([[3.0, 4], [0, 1], [6, 8], [0, 7], [300, 0], [0, 2]])
    motion = find_camera_motion(SCENE, discs_at(START, hidden=(4,)), discs_at(START + shifts))
    assert motion.shift == pytest.approx(5.0)  # of 1, 2, 5, 7 and 10


@pytest.mark.parametrize(("deviations", "static"), [(1.95, True), (2.05, False)])
def test_a_camera_is_static_below_two_standard_deviations(deviations: float, static: bool) -> None:
    """Two fiducials are known worse than the others, which does not count."""
    shift = deviations * np.sqrt(NOISE**2 + (2 * NOISE) ** 2)
    after = discs_at(START + np.array([shift, 0]), variance=(2 * NOISE) ** 2)
    after.covariances[:2] *= 100
    motion = find_camera_motion(SCENE, discs_at(START), after)
    assert motion.shift == pytest.approx(shift)
    assert (motion.planes is None) == static


@pytest.mark.parametrize("hidden", [(0, 1), (0, 1, 2)])
def test_four_fiducials_undo_a_motion_and_three_do_not(hidden: tuple[int, ...]) -> None:
    motion = find_camera_motion(
        SCENE, discs_at(START, hidden=hidden[:1]), discs_at(moved(START), hidden=hidden[1:])
    )
    assert (motion.planes is None) == (len(hidden) == 3)
    if len(hidden) == 3:  # the whole motion is in the deviations
        stated = motion.undone(discs_at(BETWEEN, variance=0.0)).covariances
        np.testing.assert_allclose(stated, np.tile(motion.shift**2 * np.eye(2), (3, 1, 1)))


def test_a_motion_is_undone_exactly_where_there_is_no_noise() -> None:
    """But for a thousandth of a pixel: the fiducials' middles are not quite where a homography has them."""
    motion = find_camera_motion(SCENE, discs_at(START, hidden=(2,)), discs_at(moved(START)))
    final = discs_at(moved(BETWEEN), hidden=(1,), variance=0.01)
    undone = motion.undone(final)
    np.testing.assert_allclose(undone.centres[[0, 2]], BETWEEN[[0, 2]], atol=1e-3)
    assert np.isnan(undone.centres[1]).all()
    np.testing.assert_array_equal(final.centres[0], moved(BETWEEN)[0])  # what was given stays
    np.testing.assert_array_equal(undone.radii, final.radii)
    assert motion.planes is not None
    np.testing.assert_allclose(motion.planes[0].pixels(SCENE.workspace.points), START, atol=0.05)
    np.testing.assert_allclose(motion.planes[1].pixels(SCENE.workspace.points), moved(START), atol=0.05)


@pytest.mark.parametrize("hidden", [(), (5,)])
def test_what_is_undone_has_the_poses_share_of_the_noise(hidden: tuple[int, ...]) -> None:
    """Of 2 n coordinates with the noise of a difference, six are spent on the pose."""
    motion = find_camera_motion(SCENE, discs_at(START), discs_at(moved(START), hidden=hidden))
    variance = 2 * NOISE**2 * 6 / (2 * (6 - len(hidden)))
    assert motion.deviation == pytest.approx(np.sqrt(variance))
    undone = motion.undone(discs_at(moved(BETWEEN), variance=0.01))
    np.testing.assert_allclose(undone.covariances, np.tile((0.01 + variance) * np.eye(2), (3, 1, 1)))


@pytest.mark.parametrize("camera", [None, Camera(1280, 720, 1100.0, 1100.0, 640.0, 360.0)])
def test_fiducials_in_a_row_tell_of_a_motion_but_do_not_undo_it(camera: Camera | None) -> None:
    """As the four before the finger, where the three behind it are hidden in the end."""
    row = Workspace(
        fiducials=(*((x, 12.0) for x in (-12.0, 15.0, 80.0, 112.0)), (-12.0, -22.0), (112.0, -22.0))
    )
    scene = FilmedScene(beam(), row, camera)
    pixels = pictured(row.points)
    motion = find_camera_motion(scene, discs_at(pixels), discs_at(moved(pixels), hidden=(4, 5)))
    assert motion.planes is None
    assert motion.shift > 1


def test_a_lens_that_is_not_known_cancels_however_well_the_ends_are_known() -> None:
    """A shift of all discs by the same is undone to the last digit, though no homography fits them."""
    shift = np.array([5.0, -3.0])
    bent = START + 2 * np.sin(START[:, ::-1])
    after = discs_at(bent + shift)
    after.covariances[:3] *= 50
    motion = find_camera_motion(SCENE, discs_at(bent), after)
    undone = motion.undone(discs_at(BETWEEN + shift))
    np.testing.assert_allclose(undone.centres, BETWEEN, atol=1e-5)


POSE = viewing_pose(CAMERA, WORKSPACE, tilt=5)
NUDGED = Pose(POSE.rotation + np.array([3e-4, -2e-4, 5e-4]), POSE.translation + np.array([0.05, -0.04, 0.1]))


@pytest.mark.parametrize(("height", "least"), [(0.0, 0.0), (20.0, 2.0)])
def test_a_nudge_is_undone_and_what_is_left_is_as_large_as_the_covariances_say(height, least):
    """The pose is that of the sheet: at 20 mm above it a wrong tilt moves the markers as well."""
    rng, noise = np.random.default_rng(3), 0.01
    scene = FilmedScene(DESIGN, WORKSPACE.model_copy(update={"marker_plane": height}), CAMERA)
    truth, there = (seen(DESIGN.markers, CAMERA, pose, height) for pose in (POSE, NUDGED))
    assert np.linalg.norm(there - truth, axis=1).min() > 20 * noise
    squares, shares = [], []
    for _ in range(30):
        ends = [seen(WORKSPACE.points, CAMERA, pose) for pose in (POSE, NUDGED)]
        noisy = [discs_at(end + rng.normal(scale=noise, size=end.shape), variance=noise**2) for end in ends]
        motion = find_camera_motion(scene, *noisy)
        assert motion.shift > 20 * noise
        undone = motion.undone(discs_at(there, variance=0.0))
        error = undone.centres - truth
        squares.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(undone.covariances), error).mean() / 2)
        shares.append(np.trace(undone.covariances, axis1=1, axis2=2).mean() / 2 / motion.deviation**2)
    assert 0.6 < np.mean(squares) < 1.5
    assert np.mean(shares) > least


def zoomed(pixels: FloatArray, larger: float) -> FloatArray:
    """Pixels after a zoom about the middle of the image."""
    middle = np.array([CAMERA.width, CAMERA.height]) / 2
    return middle + larger * (pixels - middle)


@pytest.mark.parametrize("larger", [0.97, 1.03])
def test_what_a_zoom_leaves_is_in_the_deviations(larger: float) -> None:
    """A lens that is corrected bends by the old zoom, which no pose undoes: the fiducials show it."""
    noise, places = 0.001, (WORKSPACE.points, DESIGN.markers)
    start, truth = (seen(points, CAMERA, POSE) for points in places)
    for camera in (CAMERA, None):
        fiducials = [discs_at(pixels, variance=noise**2) for pixels in (start, zoomed(start, larger))]
        motion = find_camera_motion(FilmedScene(DESIGN, WORKSPACE, camera), *fiducials)
        assert motion.enlargement == pytest.approx(larger - 1, abs=0.002)
        undone = motion.undone(discs_at(zoomed(truth, larger), variance=noise**2))
        error = np.sqrt(((undone.centres - truth) ** 2).mean())
        stated = np.sqrt(np.trace(undone.covariances, axis1=1, axis2=2).mean() / 2)
        if camera is None:  # nothing is corrected, so the whole picture is enlarged alike
            assert max(error, motion.remains) < noise
        else:
            assert error > 5 * noise
            assert 0.4 < error / stated < 2


def test_four_fiducials_do_not_show_what_a_zoom_leaves_so_the_lens_says_it() -> None:
    start, truth = (seen(points, CAMERA, POSE) for points in (WORKSPACE.points, DESIGN.markers))
    ends = [discs_at(pixels, hidden=(1, 2, 5), variance=1e-6) for pixels in (start, zoomed(start, 1.01))]
    motion = find_camera_motion(FilmedScene(DESIGN, WORKSPACE, CAMERA), *ends)
    error = motion.undone(discs_at(zoomed(truth, 1.01))).centres - truth
    assert 0.2 < np.sqrt((error**2).mean()) / motion.remains < 2


def test_another_pose_leaves_nothing() -> None:
    ends = [discs_at(seen(WORKSPACE.points, CAMERA, pose), variance=0.01**2) for pose in (POSE, NUDGED)]
    motion = find_camera_motion(FilmedScene(DESIGN, WORKSPACE, CAMERA), *ends)
    assert motion.remains == 0
    assert abs(motion.enlargement) < 0.001

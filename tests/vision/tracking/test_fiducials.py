"""Fiducials among discs: every turn and tilt, hidden ones and false ones, mirrored images."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geometry.errors import UserError
from geometry.finger.design import Design
from tests.vision.fingers import MARKERS
from vision.calibration.camera import Camera, Pose
from vision.tracking.fiducial_matching import identify_fiducials
from vision.tracking.workspace import Workspace, default_workspace

CAMERA = Camera(1280, 720, 1200.0, 1200.0, 640.0, 360.0)
WORKSPACE = default_workspace(Design())
MIDDLE = np.array([45.0, -12.0, 0.0])


def pose_of(turn, tilt=(0.0, 0.0), distance=140.0):
    """A camera at `distance`, mm, turned about its axis and tilted by these angles, degrees."""
    rotation = Rotation.from_euler("zxy", [turn, *tilt], degrees=True) * Rotation.from_rotvec([np.pi, 0, 0])
    return Pose(rotation.as_rotvec(), np.array([0, 0, distance]) - rotation.apply(MIDDLE))


def discs(pose, *, hidden=(), false=0, seed=0, workspace=WORKSPACE):
    """Pixels, radii and labels of what is seen: fiducials, markers (-2) and `false` other discs (-2)."""
    generator = np.random.default_rng(seed)
    shown = np.setdiff1d(np.arange(len(workspace.fiducials)), hidden)
    world = np.concatenate([workspace.points[shown], MARKERS["front"]])
    flat = np.column_stack([world, np.zeros(len(world))])
    scale = CAMERA.fx / (Rotation.from_rotvec(pose.rotation).apply(flat) + pose.translation)[:, 2]
    pixels = CAMERA.project(flat, pose)
    radii = np.repeat([2.0, 0.8], [len(shown), 9]) * scale
    pixels = np.concatenate([pixels, generator.uniform((0, 0), (1280, 720), (false, 2))])
    radii = np.concatenate([radii, generator.uniform(5, 25, false)])
    labels = np.concatenate([shown, np.full(9 + false, -2)])
    order = generator.permutation(len(pixels))
    return pixels[order], radii[order], labels[order]


def named(pixels, radii, labels, workspace=WORKSPACE):
    chosen = identify_fiducials(pixels, radii, workspace)
    return np.where(chosen >= 0, labels[chosen], -1).tolist()


@pytest.mark.parametrize("turn", [0, 37, 90, 180, 251])
@pytest.mark.parametrize("tilt", [(0, 0), (15, -15), (-30, 0)])
def test_every_fiducial_is_known_however_the_camera_is_held(turn, tilt):
    distance = 140 * (1 + abs(np.radians(tilt)).sum())
    assert named(*discs(pose_of(turn, tilt, distance), false=3)) == list(range(7))


@pytest.mark.parametrize("hidden", [(0,), (2, 5), (0, 6), (1, 3)])
def test_hidden_fiducials_are_missing_and_no_false_disc_takes_their_place(hidden):
    for seed in range(1, 4):
        expected = [-1 if number in hidden else number for number in range(7)]
        assert named(*discs(pose_of(10, (5, 3)), hidden=hidden, false=3, seed=seed)) == expected


def test_a_mirrored_image_is_refused():
    pixels, radii, _ = discs(pose_of(20, (4, 4)))
    with pytest.raises(UserError, match="the image is mirrored"):
        identify_fiducials((1279, 0) + pixels * (-1, 1), radii, WORKSPACE)


def test_fiducials_of_another_workspace_are_refused():
    other = Workspace(
        fiducials=tuple((1.3 * x, y + 5 * (-1) ** n) for n, (x, y) in enumerate(WORKSPACE.fiducials))
    )
    pixels, radii, _ = discs(pose_of(20), workspace=other)
    with pytest.raises(
        UserError, match=r"7 fiducials cannot be made out among 16 discs: at best \d fit, and 5 must"
    ):
        identify_fiducials(pixels, radii, WORKSPACE)


@pytest.mark.parametrize("shown", [0, 1, 4])
def test_too_few_fiducials_are_refused(shown):
    pixels, radii, _ = discs(pose_of(20), hidden=range(shown, 7))
    with pytest.raises(UserError, match="cannot be made out among"):
        identify_fiducials(pixels, radii, WORKSPACE)


def test_discs_of_another_size_are_no_fiducials():
    pixels, radii, _ = discs(pose_of(20))
    with pytest.raises(UserError, match="cannot be made out"):
        identify_fiducials(pixels, np.where(radii > radii.mean(), 2 * radii, radii), WORKSPACE)


def test_no_disc_is_no_fiducial():
    with pytest.raises(UserError, match="among 0 discs"):
        identify_fiducials(np.empty((0, 2)), np.empty(0), WORKSPACE)

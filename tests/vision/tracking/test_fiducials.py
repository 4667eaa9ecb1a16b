"""Fiducials among discs: every turn and tilt, hidden ones and false ones."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pinnray.geometry.finger.design import Design
from pinnray.vision.calibration.camera import Camera, Pose
from pinnray.vision.tracking.fiducial_matching import identify_fiducials
from pinnray.vision.tracking.workspace import default_workspace
from tests.vision.fingers import MARKERS

CAMERA = Camera(1280, 720, 1200.0, 1200.0, 640.0, 360.0)
WORKSPACE = default_workspace(Design())
MIDDLE = np.array([45.0, -12.0, 0.0])


def pose_of(turn, tilt=(0.0, 0.0), distance=140.0):
    """A camera at `distance`, mm, turned about its axis and tilted by these angles, degrees."""
    rotation = Rotation.from_euler("zxy", [turn, *tilt], degrees=True) * Rotation.from_rotvec([np.pi, 0, 0])
    return Pose(rotation.as_rotvec(), np.array([0, 0, distance]) - rotation.apply(MIDDLE))


def discs(pose, *, hidden=(), false=0, seed=0):
    """Pixels, radii and labels of what is seen: fiducials, markers (-2) and `false` other discs (-2)."""
    generator = np.random.default_rng(seed)
    shown = np.setdiff1d(np.arange(len(WORKSPACE.fiducials)), hidden)
    world = np.concatenate([WORKSPACE.points[shown], MARKERS["front"]])
    flat = np.column_stack([world, np.zeros(len(world))])
    scale = CAMERA.fx / (Rotation.from_rotvec(pose.rotation).apply(flat) + pose.translation)[:, 2]
    pixels = CAMERA.project(flat, pose)
    radii = np.repeat([2.0, 0.8], [len(shown), 9]) * scale
    pixels = np.concatenate([pixels, generator.uniform((0, 0), (1280, 720), (false, 2))])
    radii = np.concatenate([radii, generator.uniform(5, 25, false)])
    labels = np.concatenate([shown, np.full(9 + false, -2)])
    order = generator.permutation(len(pixels))
    return pixels[order], radii[order], labels[order]


def named(pixels, radii, labels):
    chosen = identify_fiducials(pixels, radii, WORKSPACE)
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

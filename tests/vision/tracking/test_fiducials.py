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


def pose_of(turn, tilt, distance):
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


@pytest.mark.parametrize(
    ("turn", "tilt", "distance", "hidden"),
    [
        (0, (0, 0), 140, ()),
        (37, (15, -15), 213, ()),
        (180, (15, -15), 213, ()),
        (251, (-30, 0), 213, ()),
        *((10, (5, 3), 140, hidden) for hidden in ((0,), (2, 5), (0, 6), (1, 3))),
    ],
)
def test_fiducials_are_known_however_the_camera_is_held_and_no_false_disc_takes_the_place_of_a_hidden_one(
    turn, tilt, distance, hidden
):
    expected = [-1 if number in hidden else number for number in range(7)]
    for seed in (1, 2):
        found = named(*discs(pose_of(turn, tilt, distance), hidden=hidden, false=3, seed=seed))
        assert found == expected

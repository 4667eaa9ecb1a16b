"""A camera that was nudged between start and end, and one that stood still."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from pinnray.vision.calibration.camera import Pose
from pinnray.vision.discs.disc_detector import DiscDetections
from pinnray.vision.rig.virtual_camera import viewing_pose
from pinnray.vision.tracking.camera_motion import find_camera_motion
from pinnray.vision.tracking.scene import FilmedScene
from pinnray.vision.tracking.tracker import track
from tests.vision.films import CAMERA, DESIGN, WORKSPACE, bent, frames_of, images

MARKERS = DESIGN.markers
SCENE = FilmedScene(design=DESIGN, workspace=WORKSPACE, camera=CAMERA)
NOISE = 0.01
POSE = viewing_pose(CAMERA, WORKSPACE, tilt=5)
NUDGED = Pose(POSE.rotation + np.array([3e-4, -2e-4, 5e-4]), POSE.translation + np.array([0.05, -0.04, 0.1]))


def discs(points, pose, rng):
    """Discs where a camera with noise sees points of the plane (n, 2), mm."""
    pixels = CAMERA.project(np.column_stack([points, np.zeros(len(points))]), pose)
    pixels += rng.normal(scale=NOISE, size=pixels.shape)
    covariances = np.tile(NOISE**2 * np.eye(2), (len(points), 1, 1))
    return DiscDetections(pixels, covariances, np.full(len(points), 8.0), np.full(len(points), 100.0))


def motion_between(rng, after, scene=SCENE):
    start, end = (discs(WORKSPACE.points, pose, rng) for pose in (POSE, after))
    return find_camera_motion(scene, start, end)


def test_noise_counts_as_a_static_camera():
    rng = np.random.default_rng(1)
    found = [motion_between(rng, POSE).planes is not None for _ in range(200)]
    assert np.mean(found) < 0.05


@pytest.mark.parametrize(("height", "least"), [(0.0, 0.0), (20.0, 2.0)])
def test_a_nudge_is_undone_and_what_is_left_is_as_large_as_the_covariances_say(height, least):
    """The pose is that of the sheet: at 20 mm above it a wrong tilt moves the markers as well."""
    rng = np.random.default_rng(3)
    scene = replace(SCENE, workspace=WORKSPACE.model_copy(update={"marker_plane": height}))
    raised = np.column_stack([MARKERS, np.full(len(MARKERS), height)])
    truth, there = CAMERA.project(raised, POSE), CAMERA.project(raised, NUDGED)
    assert np.linalg.norm(there - truth, axis=1).min() > 20 * NOISE
    exact = discs(MARKERS, POSE, rng)._replace(covariances=np.zeros((len(MARKERS), 2, 2)))
    squares, shares = [], []
    for _ in range(100):
        motion = motion_between(rng, NUDGED, scene)
        assert motion.shift > 20 * NOISE
        undone = motion.undone(exact._replace(centres=there))
        error = undone.centres - truth
        squares.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(undone.covariances), error).mean() / 2)
        shares.append(np.trace(undone.covariances, axis1=1, axis2=2).mean() / 2 / motion.deviation**2)
    assert 0.6 < np.mean(squares) < 1.5
    assert np.mean(shares) > least


@pytest.mark.slow
def test_a_film_whose_camera_was_nudged_measures_the_same_with_a_warning():
    start, end = images()[:3], images()[3:]
    turn = cv2.getRotationMatrix2D((640, 360), 0.1, 1.0) + np.array([[0, 0, 1.3], [0, 0, -0.8]])
    nudged = [cv2.warpAffine(image, turn, (1280, 720), flags=cv2.INTER_LANCZOS4) for image in end]
    tracking = track(frames_of([*start, *nudged]), SCENE)
    assert any("the camera was not at rest, which they undo" in line for line in tracking.warnings)
    errors = tracking.observations("rig").displacements - bent(MARKERS)
    assert np.abs(errors).sum(axis=1).mean() < 0.02  # 0.3 mm if it is not undone

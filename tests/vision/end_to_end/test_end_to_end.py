"""From boards and films of the virtual rig to displacements: a few scenes of the benchmarks against truth."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.tracker.films import Finger, Score, coverage
from benchmarks.tracker.scenes import random_recording, scored
from benchmarks.tracker.stress import CASES, JUMP, filmed, seen
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.vision.calibration.camera import Camera
from pinnray.vision.calibration.camera_calibration import calibrate_views
from pinnray.vision.calibration.chessboard import Board
from pinnray.vision.rig.boards import board_poses
from tests.vision.films import DESIGN, bent

pytestmark = pytest.mark.release

LENS = Camera(1280, 720, 1350.0, 1348.0, 640.0, 362.0, distortion=(-0.2, 0.03, 4e-4, -3e-4, 0.0))
BOARD = Board(9, 6, 8.0)
CORNER_NOISE = 0.02
"""Of a corner of a board, pixels."""


def finger_of(design):
    mesh = finger_mesh(design, settings=MeshSettings(size=1.0))
    return Finger(design, mesh, bent(mesh.points))


@pytest.fixture(scope="module")
def finger():
    return finger_of(DESIGN)


@pytest.fixture(scope="module")
def calibrated():
    """What noisy corners of boards say about the camera."""
    generator = np.random.default_rng(1)
    views = {
        str(number): LENS.project(BOARD.corners, pose) + generator.normal(0, CORNER_NOISE, (54, 2))
        for number, pose in enumerate(board_poses(BOARD, LENS, 24))
    }
    return calibrate_views(views, BOARD, (LENS.width, LENS.height)).camera


@pytest.fixture(scope="module")
def scores(finger, calibrated):
    """Of two scenes whose light, blur, noise, tilt and stroke are drawn at random."""
    films = [random_recording(finger, LENS, np.random.default_rng(seed), seed) for seed in range(2)]
    return [scored(film, calibrated) for film in films]


def test_random_scenes_are_measured_to_thousandths_of_a_millimetre(scores):
    for score in scores:
        assert score.seen.all()
        assert (score.swapped, score.invented) == (0, 0)
        assert score.lengths.mean() < 0.0015  # 0.02 is asked for
        assert score.lengths.max() < 0.005


def test_their_standard_deviations_are_those_of_the_errors(scores):
    ratios = np.concatenate([score.ratios for score in scores])  # 36 numbers
    assert 0.6 < np.sqrt((ratios**2).mean()) < 1.3
    one, two = coverage(scores)
    assert 0.5 < one < 0.9
    assert two > 0.85
    for score in scores:
        assert 0.2 < score.overall < 2


@pytest.mark.parametrize(
    ("case", "error", "missed"),
    [
        (("hidden", "half of 2 markers"), 0.01, 0),
        (("hidden", "3 markers"), 0.003, 3),
        (("corner", "640x360, noise 6, mp4v, jump"), 0.03, 0),
    ],
)
def test_under_stress_markers_are_missed_rather_than_swapped_or_invented(case, error, missed):
    stress = replace(CASES[case], motion=JUMP)
    design = DESIGN.replaced(marker_layout=stress.layout)
    score = seen(stress, filmed(stress, finger_of(design), 0), methods=("precise",)).scores["precise"]
    assert isinstance(score, Score)
    assert score.lengths.mean() < error
    assert (~score.seen).sum() == missed
    assert (score.swapped, score.invented) == (0, 0)

"""`pinnray rig` from the command line to its files."""

import json

import numpy as np
import pytest

from pinnray.cli import main
from pinnray.vision.calibration.chessboard import Board
from pinnray.vision.frames.sources import open_frames, photographs
from pinnray.vision.measurements import read_measurements

pytestmark = pytest.mark.usefixtures("few_elements_throughout")

QUICK = "--mesh-size 1 --size 480x270 --rest 2 --moving 0 --held 2"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("rig") / "film"
    options = f"{QUICK} --tilt 4 --noise 2 --seed 3 --boards 2 --square 9"
    assert main(["rig", *options.split(), "--out", str(out)]) == 0
    return out


def filmed(folder):
    with open_frames(folder / "video.mkv") as frames:
        return [frame.image for frame in frames]


@pytest.mark.slow
def test_it_films_the_virtual_experiment_that_compare_takes_for_measurements(folder):
    truth = read_measurements(folder / "observations_true.csv", marker_radius=0.8)
    assert truth.simulated
    assert "fem-nonlinear" in truth.source
    # The patch that the markers 4 and 5 are near is pressed in by 10 mm.
    assert truth.displacements[3:5, 1].min() < -8
    images = filmed(folder)
    assert len(images) == 4
    assert images[0].shape == (270, 480, 3)
    assert np.abs(images[0].astype(int) - images[3]).max() > 100


def test_its_boards_are_found(folder):
    images = [image for _, image in photographs([folder / "boards"])]
    assert len(images) == 2
    assert all(Board(9, 6, 9.0).find(image) is not None for image in images)


def test_the_run_says_what_it_depends_on_and_may_be_replaced(folder):
    run = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    assert set(run["files_sha256"]) >= {
        "video.mkv",
        "truth.csv",
        "truth.json",
        "camera.json",
        "boards/000.png",
    }
    assert run["rig"]["tilt"] == 4
    before = filmed(folder)
    options = f"{QUICK} --tilt 4 --noise 2 --seed 3"
    assert main(["rig", *options.split(), "--out", str(folder)]) == 0
    np.testing.assert_array_equal(filmed(folder), before)
    assert not (folder / "boards").exists()

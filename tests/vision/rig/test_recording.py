"""Recordings: frames, their truth, and the files that hold both."""

import csv
import json

import numpy as np
import pytest

from pinnray.geometry.finger.design import Design
from pinnray.vision.calibration.camera_file import load_camera
from pinnray.vision.frames.sources import open_frames
from pinnray.vision.measurements import read_measurements
from pinnray.vision.rig.bench import Bench
from pinnray.vision.rig.exposure import Exposure
from pinnray.vision.rig.motion import Motion
from pinnray.vision.rig.recording import Recording
from pinnray.vision.rig.recording_files import FILES, record
from pinnray.vision.rig.render import render, share_seen
from pinnray.vision.rig.shapes import Shape, rectangle
from pinnray.vision.rig.virtual_camera import default_camera, viewing_pose
from pinnray.vision.tracking.workspace import default_workspace, load_workspace

WORKSPACE = default_workspace(Design())
CAMERA = default_camera(320, 180)
POSE = viewing_pose(CAMERA, WORKSPACE, tilt=3)


@pytest.fixture(scope="module")
def bench(coarse_mesh):
    return Bench(coarse_mesh, Design(), WORKSPACE)


def film(bench, **changes):
    x = bench.mesh.points[:, 0] / 90
    settings = {
        "bench": bench,
        "displacement": -10 * np.column_stack([0.2 * x**2, x**2]),
        "camera": CAMERA,
        "pose": POSE,
        "exposure": Exposure(noise=2),
        "motion": Motion(rest=2, moving=2, held=2),
    }
    return Recording(**{**settings, **changes})


def test_a_frame_is_the_same_alone_and_among_all(bench):
    recording = film(bench)
    frames = list(recording.frames())
    assert len(frames) == 6
    for number in (5, 2, 0):
        image, truth = recording.frame(number)
        np.testing.assert_array_equal(image, frames[number][0])
        np.testing.assert_array_equal(truth.pixels, frames[number][1].pixels)
    assert (frames[0][0] != frames[1][0]).any()  # noise of its own


def test_the_truth_goes_from_rest_to_the_whole_displacement(bench):
    recording = film(bench)
    truths = [truth for _, truth in recording.frames()]
    start, end = truths[0].world, truths[-1].world
    np.testing.assert_array_equal(start[:, :2], bench.mesh.markers)
    observations = recording.observations("a test")
    moved = observations.displacements
    assert observations.marker_radius == recording.bench.finger.marker_radius
    np.testing.assert_allclose((end - start)[:, :2], moved, atol=1e-12)
    np.testing.assert_allclose(truths[2].world, start + truths[2].load * (end - start), atol=1e-12)
    np.testing.assert_array_equal(truths[-1].pixels, CAMERA.project(end, POSE))
    np.testing.assert_allclose(truths[0].discs, bench.mesh.markers, atol=1e-12)


def test_the_middle_of_a_disc_that_bends_is_the_mean_over_the_disc(usual_mesh):
    bench = Bench(usual_mesh, Design(), WORKSPACE)
    x, slope = bench.mesh.points[:, 0], 0.002
    recording = film(bench, displacement=np.column_stack([0 * x, slope * x**2]))
    _, truth = recording.frame(5)
    # The mean of slope (x - c)² over a disc is slope r²/4; linear elements, of 0.7 mm in the wall, add to it.
    start = recording.frame(0)[1].discs
    moved = recording.observations("a test", discs=True).displacements
    np.testing.assert_allclose(moved, truth.discs - start, atol=1e-12)
    lifted = truth.discs[:8, 1] - truth.world[:8, 1]
    np.testing.assert_allclose(lifted, slope * 0.8**2 / 4, rtol=0.35)
    np.testing.assert_allclose(truth.discs[:8, 0], truth.world[:8, 0], atol=5e-5)


@pytest.mark.slow
def test_motion_blur_is_the_mean_of_what_is_seen_while_the_shutter_is_open(bench):
    sharp = Exposure(noise=0, blur=0.7)
    recording = film(bench, exposure=sharp, motion=Motion(rest=1, moving=1, held=1, shutter=0.8))
    image, truth = recording.frame(1)
    loads = recording.motion.load(1 + 0.8 * (np.arange(40) + 0.5) / 40)
    states = [load * recording.displacement for load in loads]
    expected = np.mean([render(bench.scene(state), CAMERA, POSE, sharp) for state in states], axis=0)
    # The markers go 16 pixels; a mean of too few pictures would show them one by one.
    assert np.abs(image - expected).max() < 1.5
    pixels = np.mean([CAMERA.project(bench.markers(state), POSE) for state in states], axis=0)
    np.testing.assert_allclose(truth.pixels, pixels, atol=1e-3)


def test_the_share_of_a_marker_that_an_occluder_leaves_is_told(bench):
    still = np.zeros_like(bench.mesh.points)
    disc = bench.discs(still)[4]
    camera, pose = default_camera(), viewing_pose(default_camera(), WORKSPACE)

    def seen(share):
        radius, (x, y) = Design().marker_radius, bench.mesh.markers[4]
        edge = y + radius * (1 - 2 * share)
        return share_seen(disc, [Shape(rectangle((x - 9, edge), (x + 9, y + 9)), (0, 0, 0))], camera, pose)

    assert seen(0) == pytest.approx(1, abs=0.005)
    assert seen(0.5) == pytest.approx(0.5, abs=0.01)
    # The segment of a circle that is a quarter of the diameter high, in closed form.
    assert seen(0.25) == pytest.approx(1 - (np.arccos(0.5) - 0.5 * np.sqrt(0.75)) / np.pi, abs=0.01)
    assert seen(1) == pytest.approx(0, abs=0.005)


@pytest.mark.parametrize("codec", list(FILES))
def test_a_recording_is_read_back(codec, bench, tmp_path):
    recording = film(bench, motion=Motion(rest=1, moving=0, held=1))
    record(recording, tmp_path, source="a test", codec=codec)
    with open_frames(tmp_path / FILES[codec]) as frames:
        assert frames.simulated
        images = [frame.image for frame in frames]
    expected = [image for image, _ in recording.frames()]
    for image, exact in zip(images, expected, strict=True):
        if codec in ("ffv1", "png"):
            np.testing.assert_array_equal(image, exact)
        else:
            assert np.abs(image.astype(int) - exact).mean() < 5
    assert load_camera(tmp_path / "camera.json") == CAMERA
    assert load_workspace(tmp_path / "workspace.json").simulated
    assert load_workspace(tmp_path / "fiducials.json") == WORKSPACE  # to print
    truth = read_measurements(tmp_path / "observations_true.csv", marker_radius=0.8)
    np.testing.assert_array_equal(truth.displacements, recording.observations("").displacements)
    with (tmp_path / "truth.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * 9
    assert float(rows[-1]["x_px"]) == recording.frame(1)[1].pixels[-1, 0]
    assert json.loads((tmp_path / "truth.json").read_text(encoding="utf-8"))["exposure"]["noise"] == 2

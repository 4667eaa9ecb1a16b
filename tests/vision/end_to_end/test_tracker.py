"""Films of the virtual rig, tracked, against their truth."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from pinnray.vision.rig.motion import Course, Motion
from pinnray.vision.rig.occluders import cables
from pinnray.vision.tracking.scene import FilmedScene
from pinnray.vision.tracking.tracker import track
from tests.vision.films import (
    CAMERA,
    DESIGN,
    WORKSPACE,
    bent,
    error_of,
    frames_of,
    images,
    recording,
    tracked,
)

pytestmark = pytest.mark.usefixtures("discs_fitted_once")

MARKERS = DESIGN.markers
TRUE = bent(MARKERS)


@pytest.fixture(scope="module")
def tracking():
    return tracked(images())


def test_a_tilted_camera_measures_a_jump_of_10_mm_to_hundredths_of_a_millimetre(tracking):
    observations = tracking.observations("rig")
    assert observations.visible.all()
    assert error_of(observations) < 0.01  # 0.02 is asked for
    np.testing.assert_allclose(observations.points, MARKERS, rtol=0, atol=0.02)
    assert not observations.simulated
    assert observations.marker_radius == DESIGN.marker_radius
    assert (tracking.rest.initial, tracking.rest.final) == (range(3), range(3, 6))
    assert not any("not at rest" in line for line in tracking.warnings)


@pytest.mark.parametrize(
    ("rest", "held"),
    [
        (3, 3),  # no fifth frame among those held
        (7, 8),  # one of eight, fewer than a fifth
        (6, 4),  # none again; the one before belongs to the rest at the start
    ],
)
def test_a_live_film_is_tracked_wherever_it_is_cut(tracking, rest, held):
    pictures = images()
    film = [*(pictures[number % 3] for number in range(rest)), *(pictures[3 + n % 3] for n in range(held))]
    live = track(frames_of(film, live=True), FilmedScene(DESIGN, WORKSPACE, CAMERA))
    # Fewer of the same pictures show the fiducials: their noise is 0.01 pixels, a thousandth of a millimetre.
    found, whole = (each.observations("rig").displacements for each in (live, tracking))
    np.testing.assert_allclose(found, whole, rtol=0, atol=0.002)


def test_the_standard_deviations_are_of_the_size_of_the_errors(tracking):
    observations = tracking.observations("rig")
    errors = (observations.displacements - TRUE) / observations.standard_deviations
    assert 0.3 < np.sqrt(np.mean(errors**2)) < 1.7
    assert observations.standard_deviations.max() < 0.02


def test_the_papers_pipeline_is_an_order_of_magnitude_worse():
    tracking = tracked(images(), method="hough")
    observations = tracking.observations("rig")
    assert 0.03 < error_of(observations) < 0.4
    assert 0.05 < observations.standard_deviations.mean() < 0.2
    np.testing.assert_array_equal(observations.points, MARKERS)


@pytest.mark.slow
def test_a_marker_behind_a_cable_is_missing_and_no_other_takes_its_name():
    tracking = tracked(images(hidden=4))
    observations = tracking.observations("rig")
    np.testing.assert_array_equal(np.nonzero(~observations.visible)[0], [4])
    assert error_of(observations) < 0.015
    np.testing.assert_array_equal(observations.points[4], MARKERS[4])
    assert any("reported missing: marker 5" in warning for warning in tracking.warnings)


@pytest.mark.slow
def test_markers_that_were_lost_are_found_in_the_next_frame_that_shows_them():
    blurred = [cv2.blur(image, (200, 200)) for image in images()[:3]]
    tracking = tracked([*images()[:3], *blurred, *images()[3:]])
    assert np.isnan(tracking.pixels[3:6]).all()
    assert np.isfinite(tracking.pixels[6, :8]).all()
    assert np.isfinite(tracking.pixels[7:]).all()  # that in the tip, 21 mm from the next one, a frame later
    assert error_of(tracking.observations("rig")) < 0.01


@pytest.mark.slow
def test_a_marker_that_jumps_partly_behind_a_cable_is_found():
    film = recording()
    film = replace(
        film,
        motion=Motion(rest=1, moving=0, held=2),
        occluders=cables(film.bench, Course.proportional(film.displacement), film.motion, {5: 0.35}),
    )
    observations = tracked([image for image, _ in film.frames()]).observations("rig")
    assert observations.visible.all()
    others = np.delete(np.abs(observations.displacements - TRUE).sum(axis=1), 4)
    assert others.max() < 0.015
    assert np.abs(observations.displacements - TRUE)[4].sum() < 0.1
    assert observations.standard_deviations[4].max() > 2 * observations.standard_deviations.mean()


@pytest.mark.slow
def test_a_patch_a_little_lighter_than_the_wall_is_no_marker():
    _, truth = recording().frame(0)
    x, y = truth.pixels[4]
    patched = [image.copy() for image in images()]
    for image in patched[:3]:
        lighter = image[round(y), round(x) - 13] + 10.0
        cv2.circle(image, (round(16 * x), round(16 * y)), 9 * 16, lighter.tolist(), -1, cv2.LINE_AA, shift=4)
    observations = tracked(patched).observations("rig")
    np.testing.assert_array_equal(np.nonzero(~observations.visible)[0], [4])  # its fit is 0.25 mm off
    assert error_of(observations) < 0.015


def test_grey_images_do_as_well():
    observations = tracked([cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in images()]).observations(
        "rig"
    )
    assert error_of(observations) < 0.01

"""Films of the virtual rig, tracked, against their truth."""

import cv2
import numpy as np
import pytest

from pinnray.vision.tracking.scene import FilmedScene
from pinnray.vision.tracking.tracker import track
from tests.vision.films import CAMERA, DESIGN, WORKSPACE, bent, error_of, frames_of, images, tracked

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("discs_fitted_once")]

MARKERS = DESIGN.markers


@pytest.fixture(scope="module")
def tracking():
    return tracked(images())


def test_a_tilted_camera_measures_a_jump_of_10_mm_to_hundredths_of_a_millimetre(tracking):
    observations = tracking.observations("rig")
    assert observations.visible.all()
    assert error_of(observations) < 0.01  # 0.02 is asked for
    errors = (observations.displacements - bent(MARKERS)) / observations.standard_deviations
    assert 0.3 < np.sqrt(np.mean(errors**2)) < 1.7
    assert observations.standard_deviations.max() < 0.02
    np.testing.assert_allclose(observations.points, MARKERS, rtol=0, atol=0.02)
    assert not observations.simulated
    assert observations.marker_radius == DESIGN.marker_radius
    assert (tracking.rest.initial, tracking.rest.final) == (range(3), range(3, 6))
    assert not any("not at rest" in line for line in tracking.warnings)


@pytest.mark.parametrize(
    ("rest", "held"),
    [
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


def test_the_papers_pipeline_is_an_order_of_magnitude_worse():
    tracking = tracked(images(), method="hough")
    observations = tracking.observations("rig")
    assert 0.03 < error_of(observations) < 0.4
    assert 0.05 < observations.standard_deviations.mean() < 0.2
    np.testing.assert_array_equal(observations.points, MARKERS)


def test_grey_images_do_as_well():
    observations = tracked([cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in images()]).observations(
        "rig"
    )
    assert error_of(observations) < 0.01

"""Similarities between pictures: forward, back, derivatives; what a measurement says of its pictures."""

import numpy as np
import pytest

from pinnray.geometry.picture_frame import FIXED, FREE, Homography, Pictures, Registration, nearest_similarity

RNG = np.random.default_rng(5)
POINTS = RNG.normal(size=(7, 2)) * 30
VALUES = np.array([3.0, 0.3, -0.4, 0.01, 0.02, -0.01])
SIMILAR = Homography(POINTS.mean(axis=0), VALUES)


def test_a_similarity_turns_scales_and_shifts():
    quarter = Homography(np.array([1.0, 0.0]), np.array([90.0, 0.5, 0.0, 1.0, 0.0, 0.0]))
    np.testing.assert_allclose(quarter.moved(np.array([[2.0, 0.0]])), [[1.5, 2.0]], atol=1e-12)


def test_undone_it_gives_the_points_back():
    np.testing.assert_allclose(SIMILAR.undone(SIMILAR.moved(POINTS)), POINTS, atol=1e-12)


def test_one_without_values_changes_no_digit():
    still = Homography(POINTS.mean(axis=0), np.zeros(6))
    np.testing.assert_array_equal(still.moved(POINTS), POINTS)
    np.testing.assert_array_equal(still.undone(POINTS), POINTS)


@pytest.mark.parametrize("part", range(6))
def test_derivatives_are_those_of_differences(part):
    step = 1e-6 * np.eye(6)[part]
    ends = [Homography(SIMILAR.centre, VALUES + side * step).moved(POINTS) for side in (-1, 1)]
    np.testing.assert_allclose(SIMILAR.slopes(POINTS)[part], (ends[1] - ends[0]) / 2e-6, rtol=1e-7, atol=1e-7)


def test_a_tilt_changes_the_scale_across_100_mm():
    """Of a short line across the direction of the tilt; a tilted plane comes nearer on one side."""
    tilted = Homography(np.zeros(2), np.array([0, 0, 0, 0, 0.02, 0]))
    near, far = (np.ptp(tilted.moved(np.array([[x, -0.5], [x, 0.5]]))[:, 1]) for x in (50.0, -50.0))
    assert near - far == pytest.approx(0.02, rel=1e-3)


def test_jacobians_are_those_of_differences():
    ends = [SIMILAR.moved(POINTS[:, None] + side * 1e-6 * np.eye(2)) for side in (-1, 1)]
    slopes = np.moveaxis(ends[1] - ends[0], 1, 2) / 2e-6
    np.testing.assert_allclose(SIMILAR.jacobians(POINTS), slopes, rtol=1e-7, atol=1e-7)


def test_the_nearest_similarity_is_found_without_and_with_its_scale():
    values = np.array([3.0, 0.3, -0.4, 0.01, 0.0, 0.0])
    places = Homography(POINTS.mean(axis=0), values).moved(POINTS)
    np.testing.assert_allclose(nearest_similarity(POINTS, places).values, values, atol=1e-12)
    values[3] = 0
    np.testing.assert_allclose(nearest_similarity(POINTS, places, rigid=True).values, values, atol=1e-12)


def test_a_finger_at_rest_shows_the_motion_of_the_picture():
    """A wrong drawing shows nothing by itself: both pictures are in its frame."""
    fixed = Homography(SIMILAR.centre, np.zeros(6))
    still = np.zeros_like(POINTS)
    np.testing.assert_allclose(Pictures(fixed, SIMILAR).shown(POINTS, still), 0, atol=1e-12)
    shown = Pictures(SIMILAR, fixed).shown(POINTS, still)
    np.testing.assert_allclose(shown, SIMILAR.moved(POINTS) - POINTS, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "known"),
    [
        ("fixed", FIXED),
        (" Free ", FREE),
        ("turn 2 deg, shift 0.3 mm, scale 1 %", Registration(2.0, 0.3, 0.01)),
        ("scale 0.5%", Registration(scale=0.005)),
        ("tilt 2 % per 100 mm", Registration(tilt=0.02)),
        ("shift 1e-1 mm,turn 3deg", Registration(turn=3.0, shift=0.1)),
    ],
)
def test_a_text_says_how_well_a_frame_is_known(text, known):
    assert Registration.parse(text) == known
    assert Registration.parse(str(known)) == known

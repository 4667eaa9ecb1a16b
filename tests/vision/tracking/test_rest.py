"""When the finger rests, for motions of known beginning and end."""

import numpy as np
import pytest

from pinnray.vision.tracking.rest_detection import RestIntervals, find_rest_intervals
from tests.vision.fingers import MARKERS, PRESSED

WHOLE = np.array(PRESSED["front"])[0]


def film(shares, *, noise=0.0, seed=0):
    """Positions, shape (f, 9, 2), mm, when the finger is pressed by these shares of the stroke."""
    still = MARKERS["front"] + np.asarray(shares)[:, None, None] * WHOLE
    return still + np.random.default_rng(seed).normal(0, noise, still.shape)


RAMP = np.concatenate([np.zeros(12), np.linspace(0, 1, 30)[1:-1], np.ones(20)])


@pytest.mark.parametrize("noise", [0.0, 0.002, 0.01, 0.05])
@pytest.mark.parametrize("seed", range(5))
def test_rest_is_found_to_the_frame_or_two_however_noisy(noise, seed):
    rest = find_rest_intervals(film(RAMP, noise=noise, seed=seed))
    assert 11 <= rest.initial.stop <= 13
    assert 39 <= rest.final.start <= 41
    assert (rest.initial.start, rest.final.stop) == (0, 60)


def test_hidden_markers_do_not_matter():
    positions = film(RAMP, noise=0.002)
    positions[np.random.default_rng(1).uniform(size=(60, 9)) < 0.3] = np.nan
    rest = find_rest_intervals(positions)
    assert (rest.initial.stop, rest.final.start) == (12, 40)


def test_a_finger_that_swings_rests_when_it_has_stopped():
    swing = 1 + 0.2 * np.exp(-np.arange(60) / 8) * np.cos(np.arange(60))
    rest = find_rest_intervals(film([*np.zeros(10), *np.linspace(0, 1, 10), *swing, *np.ones(10)]))
    assert rest.final.start > 45


def test_one_stray_frame_is_no_motion():
    positions = film(RAMP, noise=0.002)
    positions[5] += 1
    assert find_rest_intervals(positions).initial == range(12)


def test_two_pictures_are_before_and_after():
    assert find_rest_intervals(film([0, 1])) == RestIntervals(range(1), range(1, 2))


@pytest.mark.parametrize("held", [1, 10])
def test_a_finger_that_comes_back_was_pressed_where_it_was_farthest(held):
    way = np.linspace(0, 1, 30)
    rest = find_rest_intervals(
        film([*np.zeros(12), *way, *np.ones(held - 1), *way[::-1], *np.zeros(9)], noise=0.002)
    )
    assert 11 <= rest.initial.stop <= 13
    assert 40 <= rest.final.start <= 41
    assert abs(rest.final.stop - (41 + held)) <= 1

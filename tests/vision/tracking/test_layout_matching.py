"""Markers among discs without fiducials: any similarity, hidden markers, false discs, what looks the same."""

from itertools import pairwise

import numpy as np
import pytest

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.tracking.layout_matching import match_layout

DIAMETER, SCALE = 1.6, 8.0
"""Of the markers, mm, and of the picture, pixels per mm."""
UNEVEN = np.array([[0.0, 0], [10, 3], [21, -2], [30, 6], [43, 1], [55, -4], [60, 9]])
"""Seven markers without a symmetry; the nearest two are 10.3 mm apart."""


def seen(places: FloatArray, turn: float = 0.0) -> FloatArray:
    """Pixels of places, shape (n, 2), mm, turned in the image by an angle, degrees, counter-clockwise."""
    cos, sin = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    x, y = np.array([[cos, -sin], [sin, cos]]) @ places.T
    return np.column_stack([600 + SCALE * x, 400 - SCALE * y])


def names(pixels: FloatArray, markers: FloatArray, sizes: FloatArray | float = 1.0) -> list[int]:
    radii = np.broadcast_to(sizes, len(pixels)) * SCALE * DIAMETER / 2
    return match_layout(pixels, radii, markers, DIAMETER).tolist()


@pytest.mark.parametrize("turn", [0, 50, 91, 180, 271, 333])
def test_markers_are_known_however_the_image_is_turned_and_whatever_the_discs_order(turn: int) -> None:
    order = np.random.default_rng(turn).permutation(7)
    found = names(seen(UNEVEN, turn)[order], UNEVEN)
    assert order[found].tolist() == list(range(7))


def test_the_scale_of_the_picture_is_found_by_the_size_of_the_discs() -> None:
    for scale in (0.3, 4.0):
        radii = np.full(7, scale * SCALE * DIAMETER / 2)
        assert match_layout(scale * seen(UNEVEN), radii, UNEVEN, DIAMETER).tolist() == list(range(7))
    with pytest.raises(UserError, match="can be made out among 7 discs"):
        names(2 * seen(UNEVEN), UNEVEN)


def test_hidden_markers_are_missing_and_false_discs_have_no_name() -> None:
    false = np.array([[500.0, 500], [900, 300], [700, 620]])
    pixels = np.concatenate([false, np.delete(seen(UNEVEN, 30), [1, 4], axis=0)])
    assert names(pixels, UNEVEN) == [3, -1, 4, 5, -1, 6, 7]


@pytest.mark.parametrize(("size", "name"), [(0.72, 5), (1.39, 5), (0.7, -1), (1.41, -1)])
def test_a_disc_of_another_size_is_no_marker(size: float, name: int) -> None:
    """Beyond a ratio of 1.4."""
    sizes = np.ones(7)
    sizes[5] = size
    assert names(seen(UNEVEN), UNEVEN, sizes) == [0, 1, 2, 3, 4, name, 6]


@pytest.mark.parametrize(("share", "name"), [(0.14, 3), (0.16, -1)])
@pytest.mark.parametrize("direction", [0, 130, 270])
def test_a_disc_is_no_marker_farther_away_than_a_share_of_the_spacing(share, name, direction):
    """0.15 of the smallest distance of two markers, here √109 mm."""
    away = share * 109**0.5 * np.array([np.cos(np.radians(direction)), np.sin(np.radians(direction))])
    places = UNEVEN.copy()
    places[3] += away
    assert names(seen(places), UNEVEN) == [0, 1, 2, name, 4, 5, 6]


SHIFTS = np.array([[0, 1.0], [1, 0], [0, -1], [-1, 0], [0.6, 0.8], [-0.8, 0.6], [0.8, -0.6]])


@pytest.mark.parametrize(("shown", "chosen"), [(4, [0, 1, 2, 3, 4, -1, 6]), (5, [7, 8, 9, 10, 11, -1, -1])])
def test_a_marker_far_off_counts_less_than_an_exact_one_and_more_than_none(shown, chosen):
    """Six that are a millimetre off (one is beyond the gate) outweigh four that are exact, and not five."""
    both = np.concatenate([UNEVEN + SHIFTS - (0, 30), UNEVEN[:shown]])
    assert names(seen(both), UNEVEN) == chosen


@pytest.mark.parametrize("turn", [0, 40, -89, 91, 180, 269])
def test_in_a_row_x_runs_to_the_right(turn: int) -> None:
    row = np.column_stack([np.arange(0.0, 50, 10), np.zeros(5)])
    pixels = seen(row, turn)
    found = names(pixels, row)
    assert sorted(found) == list(range(5))
    assert all(pixels[one, 0] < pixels[other, 0] for one, other in pairwise(found))


@pytest.mark.parametrize(("single", "turned"), [(1, False), (2, True)])
def test_that_x_runs_to_the_right_outweighs_one_marker_and_not_two(single: int, turned: bool) -> None:
    """Three pairs look the same after a half turn, one or two markers do not; the image is upside down."""
    pairs = np.array([[10.0, 0], [20, 4], [31, -3]])
    markers = np.concatenate([pairs, -pairs, np.array([[3.0, 14], [-26, 17]])[:single]])
    found = names(seen(markers, 180), markers)
    own, other = list(range(6)), [3, 4, 5, 0, 1, 2]
    assert found == ([*own, *range(6, 6 + single)] if turned else [*other, -1])


@pytest.mark.parametrize(("away", "refused"), [(1.6, True), (3.0, False)])
def test_what_differs_by_more_than_the_gate_does_not_look_the_same(away: float, refused: bool) -> None:
    """A square of 14.1 mm with one corner off: 0.15 of the smallest distance is 2.1 mm."""
    square = 10.0 * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    inner = np.concatenate([3 * square, square])
    inner[4] += (away, 0)
    if refused:
        with pytest.raises(UserError, match="the same after a turn by 90 degrees"):
            names(seen(inner), inner)
    else:
        assert names(seen(inner), inner) == list(range(8))


@pytest.mark.parametrize(("count", "least"), [(4, 3), (5, 3), (6, 3), (7, 4)])
def test_half_of_the_markers_and_three_must_be_seen(count: int, least: int) -> None:
    markers = UNEVEN[:count]
    assert (np.array(names(seen(markers)[:least], markers)) >= 0).sum() == least
    with pytest.raises(UserError, match="can be made out"):
        names(seen(markers)[: least - 1], markers)

"""Points of a second picture that are listed in another order, told from their displacements alone."""

import numpy as np
import pytest

from pinnray.vision.point_order import likeliest_order, order_text

NAMES = [f"{number}" for number in range(1, 13)]
POINTS = np.column_stack([np.repeat(np.arange(10.0, 70, 10), 2), np.tile([-1.0, -16.0], 6)])
BENT = np.column_stack([0.02 * POINTS[:, 0], -0.004 * POINTS[:, 0] ** 2])  # up to 15 mm


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_any_two_points_that_are_exchanged_are_named(noise):
    there = POINTS + BENT + np.random.default_rng(1).normal(0, noise, BENT.shape)
    for one, other in zip(*np.triu_indices(12, 1), strict=True):
        order = np.arange(12)
        order[[one, other]] = order[[other, one]]
        found = likeliest_order(POINTS, there[order])
        assert order_text(found.order, NAMES) == f"with {one + 1} and {other + 1} exchanged"


def test_a_shuffled_list_whose_y_runs_the_other_way_in_a_cut_picture_is_put_right():
    order = np.random.default_rng(2).permutation(12)
    there = ((POINTS + BENT) * [1, -1] + [300, 40])[order]
    found = likeliest_order(POINTS, there, may_flip=True)
    assert found.flipped
    assert order[found.order].tolist() == list(range(12))


@pytest.mark.parametrize("size", [0.0, 0.1, 1.0, 2.0])
@pytest.mark.parametrize("noise", [0.0, 0.1, 1.0])
def test_a_right_order_is_left_as_it_is_whatever_the_displacement(size, noise):
    turned = POINTS @ [[0.996, 0.087], [-0.087, 0.996]] - POINTS  # by 5 degrees
    for seed in range(5):
        rng = np.random.default_rng(seed)
        there = POINTS + size * BENT + turned + rng.normal(0, noise, BENT.shape)
        assert likeliest_order(POINTS, there, may_flip=True).order.tolist() == list(range(12))


def test_an_outlier_is_no_other_order():
    there = POINTS + BENT
    there[4] += (9.0, 6.0)
    assert likeliest_order(POINTS, there).gain == 0

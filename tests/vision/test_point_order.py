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


def test_an_outlier_is_no_other_order():
    there = POINTS + BENT
    there[4] += (9.0, 6.0)
    assert likeliest_order(POINTS, there).gain == 0

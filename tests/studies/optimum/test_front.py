"""Fronts and hypervolumes against hand counts."""

import numpy as np
import pytest

from pinnray.studies.optimum.front import hypervolume, reference_point, unbeaten


def test_a_front_is_what_no_point_beats() -> None:
    costs = np.array([[1.0, 3.0], [2.0, 2.0], [3.0, 1.0], [3.0, 3.0], [2.5, 2.0]])
    assert unbeaten(costs).tolist() == [True, True, True, False, False]
    assert unbeaten(np.empty((0, 2))).tolist() == []


def test_the_hypervolume_of_two_steps() -> None:
    # Rectangles to (4, 4): 3 x 1 above the first point and 1 x 2 beside it below the second.
    assert hypervolume(np.array([[1.0, 3.0], [3.0, 1.0]]), np.array([4.0, 4.0])) == pytest.approx(5.0)
    assert hypervolume(np.array([[5.0, 1.0]]), np.array([4.0, 4.0])) == 0


def test_the_hypervolume_of_a_box() -> None:
    assert hypervolume(np.array([[1.0, 2.0, 3.0]]), np.array([2.0, 4.0, 6.0])) == pytest.approx(6.0)


def test_the_reference_point_is_worse_than_all() -> None:
    costs = np.array([[1.0, -3.0], [2.0, -5.0]])
    assert reference_point(costs) == pytest.approx([2.1, -2.8])
    assert (reference_point(np.array([[1.0, 1.0]])) > 1).all()

from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest

from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.figures.body import DIVERGING, ColourScale, sequential, symmetric
from pinnray.comparison.figures.fields import QUANTITIES, field_scale, max_principal
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh

VON_MISES, XY = QUANTITIES[0], QUANTITIES[-1]


def test_a_sequential_scale_leaves_out_the_last_half_percent_of_the_area() -> None:
    values, weights = np.array([7.0, 100.0, 3.0]), np.array([0.5, 0.004, 0.496])
    assert sequential(values, weights)[:2] == (0.0, 7.0)
    assert sequential(values, np.array([0.5, 0.006, 0.494]))[:2] == (0.0, 100.0)


def test_a_symmetric_scale_takes_absolute_values() -> None:
    weights = np.ones(3)
    assert (zero := symmetric(np.zeros(3), weights)).low < 0 < zero.high
    assert symmetric(np.array([1.0, -4.0, 2.0]), weights)[:2] == (-4.0, 4.0)


def test_values_beyond_the_scale_take_the_end_colours() -> None:
    scale = ColourScale(0.0, 1.0, mpl.colormaps[DIVERGING])
    painted = scale.paint(np.array([-5.0, 0.0, 1.0, 5.0]))
    np.testing.assert_array_equal(painted[[0, 3]], painted[[1, 2]])


def test_every_solver_is_drawn_on_the_scale_of_the_reference(fem: Evaluation, mesh: TriangleMesh) -> None:
    peak = fem.von_mises.copy()
    peak[:3] = 1e6  # one triangle of 384: 0.26 % of the area
    scale = field_scale(VON_MISES, mesh, replace(fem, von_mises=peak))
    without = np.sort(fem.per_triangle(fem.von_mises))
    assert without[-3] <= scale.high <= without[-1]


def test_a_small_difference_is_not_blank_beside_a_solver_that_is_far_away(fem, failed, evaluate, mesh):
    """The near solver is off by a hundredth of the field, the other one by twice the field."""
    near, base = evaluate("near", 1.01), field_scale(VON_MISES, mesh, fem).high
    difference, far = (each.per_triangle(each.von_mises - fem.von_mises) for each in (near, failed))
    scale = symmetric(difference, mesh.areas)
    assert scale.high == -scale.low == pytest.approx(0.01 * base)
    painted = scale.paint(difference)
    assert np.ptp(painted.astype(int), axis=1).max() > 100  # no grey
    assert symmetric(far, mesh.areas).high > base


def test_the_largest_principal_strain_by_hand() -> None:
    tensors = np.array([[[3.0, 0.0], [0.0, -1.0]], [[0.0, 2.0], [2.0, 0.0]], [[1.0, 2.0], [2.0, 4.0]]])
    np.testing.assert_allclose(max_principal(tensors), [3.0, 2.0, 5.0])

from dataclasses import replace

import numpy as np
import pytest

from pinnray.comparison.evaluation.comparison import pick_reference
from pinnray.comparison.evaluation.differences import FieldDifference
from pinnray.comparison.evaluation.metrics import force_error, marker_errors, truth_differences
from pinnray.comparison.evaluation.scores import MEANS, Scores
from pinnray.runtime.arrays import weighted_percentile
from pinnray.solvers.problem import Load


@pytest.mark.parametrize(
    ("percent", "expected"),
    [
        (5, 1.0),  # the smallest value holds a tenth of the weight
        (50, 2.0),  # the heavy one
        (90, 2.0),  # exactly where the heavy one ends
        (95, 3.0),  # in the last tenth
        (100, 3.0),  # all of it
    ],
)
def test_weighted_percentile_of_three_values(percent, expected):
    values, weights = np.array([3.0, 1.0, 2.0]), np.array([1.0, 1.0, 8.0])
    assert weighted_percentile(values, weights, percent) == expected


def test_errors_at_the_markers_by_hand(observe):
    moved = np.array([[1.0, -2.0], [50.0, 50.0], [-5.0, 6.0]])
    errors = marker_errors(moved, observe(np.zeros((3, 2)), hidden=(1,)))
    np.testing.assert_array_equal(errors.ae_u, [1, np.nan, 5])
    np.testing.assert_array_equal(errors.ae_v, [2, np.nan, 6])
    assert errors.model_dump(include=set(MEANS)) == {"mae_u": 3, "mae_v": 4, "mae_sum": 7, "mae_rss": 5}
    unseen = marker_errors(moved, observe(np.zeros((3, 2)), hidden=(0, 1, 2)))
    assert np.isnan([getattr(unseen, name) for name in MEANS]).all()


def test_held_out_errors_are_of_what_the_solver_was_not_given(fem, observe, compared):
    seen = observe(fem.marker_displacement + 1.0)

    def held_out(evaluation, observations=seen):
        return compared(evaluation, observations=observations).scores["fem"].held_out

    assert held_out(fem, observe(np.zeros((3, 2)), hidden=(0, 1, 2))) is None
    free = held_out(fem)
    assert (free.mae_u, free.mae_v) == pytest.approx((1, 1))  # it was given no marker
    given = replace(fem, in_sample=True)
    assert held_out(given) is None
    told = held_out(replace(given, left_out=fem.marker_displacement + 3.0))
    assert (told.mae_u, told.mae_v) == pytest.approx((2, 2))


def test_the_numbers_come_back_from_their_file(estimated, pinn, compared, tmp_path):
    """With those that do not exist, such as the force of a truth that nobody knows."""
    scores = compared(estimated, replace(pinn, in_sample=True), warnings=["careful"]).scores
    scores.write(tmp_path)
    again = Scores.read(tmp_path)
    assert np.isnan(again["fem"].force_to_truth_rel)
    again.write(tmp_path / "again")
    files = [(place / "metrics.json").read_text() for place in (tmp_path, tmp_path / "again")]
    assert files[0] == files[1]


@pytest.mark.parametrize(
    ("values", "reference", "expected"),
    [
        ([2.0, 0.0], [1.0, 0.0], (1.0, 0.25, 1.0)),  # off by one on a quarter of the area
        ([0.0, 3.0], [0.0, 2.0], (0.5, 0.75, 1.0)),  # off by one on three quarters
        ([1.0, 1.0], [1.0, 1.0], (0.0, 0.0, 0.0)),  # equal
        ([[3.0, 4.0], [0.0, 0.0]], [[0.0, 0.0], [5.0, 0.0]], (2 / 3**0.5, 5.0, 5.0)),  # vectors, by length
    ],
)
def test_difference_of_fields_by_hand(values, reference, expected):
    difference = FieldDifference.of(np.array(values), np.array(reference), np.array([1.0, 3.0]))
    assert (difference.rel_l2, difference.mean, difference.p95) == pytest.approx(expected)


def test_a_reference_of_zeros_has_no_relative_difference():
    assert np.isnan(FieldDifference.of(np.ones(2), np.zeros(2), np.ones(2)).rel_l2)


def test_strain_differences_tell_components_apart(fem):
    strain = fem.strain.copy()
    strain[:, 0, 0] += 0.5
    differences = replace(fem, strain=strain).differences_from(fem)
    assert {name: d.mean for name, d in differences.strain.items()} == pytest.approx(
        {"xx": 0.5, "yy": 0, "xy": 0}
    )


def test_the_reference_is_the_wanted_solver_then_fem_then_the_first(fem, pinn, failed):
    assert pick_reference([failed, pinn, fem], "pinn-std") is pinn
    assert pick_reference([failed, pinn, fem]) is fem
    assert pick_reference([failed, pinn]) is failed


def test_differences_from_the_truth_are_those_of_whole_tensors(fem):
    strain = fem.strain.copy()
    strain[:, 0, 0] += 0.3
    strain[:, 1, 1] += 0.4
    other = replace(fem, strain=strain, displacement=2 * fem.displacement)
    differences = truth_differences(other, fem)
    assert differences.strain.mean == pytest.approx(0.5)
    assert differences.displacement.rel_l2 == pytest.approx(1)
    assert differences.von_mises.rel_l2 == 0


@pytest.mark.parametrize(("factor", "expected"), [(1.5, 0.5), (0.75, -0.25), (-1, -2)], ids=str)
def test_the_error_of_the_force_is_that_of_its_component_along_the_stroke(fem, factor, expected):
    """A force across the stroke, which is twenty times as large, is none of it."""
    pressed = replace(fem, reaction=np.array([0.0, -0.5]))
    other = replace(fem, reaction=np.array([10.0, -0.5 * factor]))
    assert force_error(other, pressed, Load()) == pytest.approx(expected)
    assert force_error(other, pressed, Load(displacement=(None, -10.0))) == pytest.approx(expected)

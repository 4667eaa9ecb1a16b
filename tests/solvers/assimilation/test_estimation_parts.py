"""The parts of an estimate: priors, φ, intervals and the search, against closed forms and SciPy."""

from collections.abc import Callable
from dataclasses import replace
from math import e, inf
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2, lognorm, norm, t

from geometry.arrays import FloatArray
from solvers.assimilation import estimation
from solvers.assimilation.estimation import (
    Estimate,
    Parameter,
    Prediction,
    degrees_of_freedom,
    estimate,
    inflation_of,
)

LENGTH = Parameter("length", "mm", 3.0, 0.5)
FACTOR = Parameter("factor", "", 2.0, 0.25, logarithmic=True)
ONE = Parameter("one", "", 0.0, 1.0)


def test_what_is_not_given_is_as_documented() -> None:
    """Levels, rounds and steps of every published estimate."""
    assert (estimation.LEVEL, estimation.MIN_RESOLUTION) == (0.95, 0.5)
    assert (estimation.MAX_ROUNDS, estimation.INFLATION_CHANGE) == (8, 0.01)
    assert (estimation.MAX_STEPS, estimation.COST_CHANGE) == (12, 1e-4)
    assert (ONE.low, ONE.high, ONE.logarithmic) == (-inf, inf, False)


@pytest.mark.parametrize("z", [-2.0, 0.0, 1.3])
def test_a_value_is_at_the_priors_quantile(z: float) -> None:
    share = norm.cdf(z)
    assert LENGTH.value(z) == pytest.approx(norm.ppf(share, loc=3.0, scale=0.5), rel=1e-12)
    assert FACTOR.value(z) == pytest.approx(lognorm.ppf(share, s=0.25, scale=2.0), rel=1e-12)


@pytest.mark.parametrize("parameter", [LENGTH, FACTOR])
def test_the_derivative_is_that_of_differences(parameter: Parameter) -> None:
    difference = (parameter.value(0.7 + 1e-6) - parameter.value(0.7 - 1e-6)) / 2e-6
    assert parameter.derivative(0.7) == pytest.approx(float(difference), rel=1e-8)


@pytest.mark.parametrize("parameter", [LENGTH, FACTOR])
def test_at_its_bounds_a_parameter_has_the_bounds_values(parameter: Parameter) -> None:
    low, high = replace(parameter, low=0.8, high=7.0).bounds
    np.testing.assert_allclose([parameter.value(low), parameter.value(high)], [0.8, 7.0], rtol=1e-12)


def test_a_positive_parameter_has_no_bound_at_zero_or_below() -> None:
    assert FACTOR.bounds == (-inf, inf)
    assert replace(FACTOR, low=0.0, high=2 * e**0.5).bounds == (-inf, pytest.approx(2.0, rel=1e-12))
    assert replace(FACTOR, low=0.5).bounds[0] == pytest.approx(np.log(0.25) / 0.25, rel=1e-12)


def as_found(sensitivities: FloatArray, inflation: float = 1.0, z: float = 0.0) -> Estimate:
    count, parameters = len(sensitivities), [LENGTH, FACTOR, ONE][: sensitivities.shape[1]]
    places = np.full(len(parameters), z)
    return Estimate(parameters, places, sensitivities, np.zeros(count), inflation, 1, converged=True)


def test_the_condition_is_that_of_an_ellipsoid() -> None:
    """Semi-axes 5, 4 and 2: singular values of a diagonal matrix in any frame."""
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    found = as_found(turn @ np.diag([2.0, 5.0, 4.0]))
    np.testing.assert_allclose(found.singular_values, [5.0, 4.0, 2.0], rtol=1e-12)
    assert found.condition == pytest.approx(2.5, rel=1e-12)
    assert as_found(np.array([[1.0, 0.0]])).condition == inf


def test_a_parameter_is_resolved_from_half_of_its_prior_on() -> None:
    """With the sensitivity s of one observation the prior's variance falls to 1 / (1 + s²)."""
    for sensitivity, resolved in ((0.9, False), (1.0, True), (1.1, True)):
        found = as_found(np.array([[sensitivity]]))
        assert found.resolution == pytest.approx([sensitivity**2 / (1 + sensitivity**2)], rel=1e-12)
        assert found.resolved.tolist() == [resolved]


@pytest.mark.parametrize("inflation", [1.0, 1.5])
def test_intervals_are_quantiles_of_the_normal_or_of_students_t(inflation: float) -> None:
    sensitivities = np.array([[3.0, 0.0], [0.0, 4.0], [0.0, 0.0], [0.0, 0.0]])
    found = as_found(sensitivities, inflation, 0.2)
    freedom = 4 - 9 / 10 - 16 / 17
    ends = [0.025, 0.975]
    quantiles = norm.ppf(ends) if inflation == 1 else t.ppf(ends, freedom)
    deviations = np.sqrt([1 / 10, 1 / 17])
    expected = [LENGTH.value(0.2 + deviations[0] * quantiles), FACTOR.value(0.2 + deviations[1] * quantiles)]
    np.testing.assert_allclose(found.intervals, expected, rtol=1e-12)
    np.testing.assert_allclose(found.values, [3.1, 2 * e**0.05], rtol=1e-12)
    np.testing.assert_allclose(found.deviations, deviations * [0.5, 0.25 * 2 * e**0.05], rtol=1e-12)


def test_degrees_of_freedom_are_those_of_the_ridge_and_at_least_one() -> None:
    matrix = np.random.default_rng(0).normal(size=(7, 3))
    hat = matrix @ np.linalg.inv(matrix.T @ matrix + np.eye(3)) @ matrix.T
    assert degrees_of_freedom(matrix) == pytest.approx(7 - np.trace(hat), rel=1e-12)
    assert degrees_of_freedom(1e6 * np.eye(3)) == 1


def test_the_misfit_is_noise_up_to_the_95th_percentile() -> None:
    edge = chi2.ppf(0.95, 6)
    assert inflation_of(np.sqrt([edge - 1e-9]), 6) == 1
    assert inflation_of(np.sqrt([edge / 2 + 1, edge / 2]), 6) == pytest.approx(np.sqrt((edge + 1) / 6))


@pytest.mark.parametrize(("count", "size"), [(1, 1.0), (3, 1.0), (2, 0.1)])
def test_the_inflation_satisfies_its_own_equation(count: int, size: float) -> None:
    """φ² (n - tr H) is the misfit under φ, by the normal equations; of small slopes the prior weighs most."""
    random = np.random.default_rng(3)
    slopes = size * random.normal(size=(20, count))
    observed = slopes @ np.full(count, 0.5 / size) + random.normal(size=20)
    found = estimate(lambda values: (slopes @ values, slopes), observed, np.full(20, 0.2), [ONE] * count)
    scaled = slopes / 0.2 / found.inflation
    z = np.linalg.solve(scaled.T @ scaled + np.eye(count), scaled.T @ observed / 0.2 / found.inflation)
    residuals = (slopes @ z - observed) / 0.2
    freedom = 20 - np.trace(scaled @ np.linalg.inv(scaled.T @ scaled + np.eye(count)) @ scaled.T)
    assert found.inflation > 3
    assert found.inflation == pytest.approx(np.sqrt(residuals @ residuals / freedom), rel=1e-4)
    np.testing.assert_allclose(found.z, z, rtol=1e-6)
    np.testing.assert_allclose(found.residuals, residuals / found.inflation, rtol=1e-3)
    np.testing.assert_allclose(found.sensitivities, scaled, rtol=1e-12)
    assert found.converged


def decay(calls: list[float], low: float, high: float) -> Callable[[FloatArray], Prediction | None]:
    """A model of one parameter that notes what it was asked for; there is none outside of two limits."""

    def model(values: FloatArray) -> Prediction | None:
        (value,) = values.tolist()
        calls.append(value)
        if not low <= value <= high:
            return None
        return np.exp(-value) * np.ones(4), -np.exp(-value) * np.ones((4, 1))

    return model


def searched(calls: list[float], low: float = -inf, high: float = inf, **settings: Any) -> Estimate:
    """The search for 2, of which the prior knows 0 and little."""
    prior, model = Parameter("rate", "1/s", 0.0, 10.0), decay(calls, low, high)
    return estimate(model, np.full(4, np.exp(-2.0)), np.full(4, 1e-3), [prior], **settings)


def test_the_model_is_asked_once_for_every_place() -> None:
    calls: list[float] = []
    found = searched(calls)
    assert found.values == pytest.approx([2.0], abs=0.01)
    assert found.converged
    assert found.evaluations == len(calls) == len(set(calls))


def test_the_search_starts_where_it_is_told_to() -> None:
    calls: list[float] = []
    assert searched(calls, start=np.array([0.19])).values == pytest.approx([2.0], abs=0.01)
    assert calls[0] == pytest.approx(1.9)
    calls.clear()
    searched(calls)
    assert calls[0] == 0


def test_where_there_is_no_prediction_the_search_starts_at_the_priors_middle() -> None:
    calls: list[float] = []
    found = searched(calls, high=2.5, start=np.array([0.3]))
    assert calls[:2] == pytest.approx([3.0, 0.0])
    assert found.values == pytest.approx([2.0], abs=0.01)


def test_a_step_to_where_there_is_no_prediction_is_taken_back() -> None:
    calls: list[float] = []
    found = searched(calls, low=1.5, start=np.array([0.3]))  # a Newton step from 3 leads to 1.28
    assert min(calls) < 1.5
    assert found.values == pytest.approx([2.0], abs=0.01)


def test_a_search_that_ends_early_says_so() -> None:
    for settings in ({"steps": 1}, {"steps": 2, "rounds": 1}):
        assert not searched([], **settings).converged
    few, many = list[float](), list[float]()
    loose = searched(few, cost_change=0.5)
    assert loose.converged
    searched(many, cost_change=1e-12)
    assert len(few) < len(many)


def test_noise_a_hundred_times_smaller_is_fitted_no_further_than_the_noise() -> None:
    """The cost that counts for convergence has half the number of observations added."""
    calls, one = list[float](), np.ones(4)

    def curved(values: FloatArray) -> Prediction:
        calls.append(float(values[0]))
        return values[0] * one + 1e-3 * values[0] ** 2, (one + 2e-3 * values[0])[:, None]

    estimate(curved, one, one, [replace(ONE, scale=100.0)])
    assert len(calls) <= 3

"""Estimates of parameters, their priors, φ and intervals, against closed forms, refits, noise and SciPy."""

from collections.abc import Callable
from dataclasses import replace
from math import e, inf
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import chi2, lognorm, norm, t

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.assimilation.estimation import (
    Estimate,
    GrossErrors,
    Parameter,
    Prediction,
    Prior,
    estimate,
    inflation_of,
)

COUNT = 12
PARAMETERS = [Parameter("a", "mm", 1.0, 2.0), Parameter("b", "", -1.0, 0.5), Parameter("c", "", 3.0, 10.0)]
START, SCALE = np.array([1.0, -1.0, 3.0]), np.array([2.0, 0.5, 10.0])


@pytest.fixture(scope="module")
def slopes():
    return np.random.default_rng(0).normal(size=(COUNT, 3))


def linear(slopes):
    return lambda values: (slopes @ values, slopes)


def fitted(slopes, observed, sigma=0.1, parameters=PARAMETERS):
    return estimate(linear(slopes), observed, np.full(len(observed), sigma), parameters)


def test_a_linear_model_has_the_estimate_of_the_normal_equations(slopes):
    truth, sigma = START + 0.3 * SCALE, 0.1
    observed = slopes @ truth + sigma * np.random.default_rng(1).normal(size=COUNT)
    found = fitted(slopes, observed, sigma)
    precision = slopes.T @ slopes / sigma**2 + np.diag(1 / SCALE**2)
    expected = np.linalg.solve(precision, slopes.T @ observed / sigma**2 + START / SCALE**2)
    np.testing.assert_allclose(found.values, expected, rtol=1e-7)
    np.testing.assert_allclose(found.deviations**2, np.diag(np.linalg.inv(precision)), rtol=1e-7)
    assert found.inflation == 1
    assert found.converged


def test_a_wrong_observation_is_left_out_and_a_wrong_model_loses_none(slopes):
    """Of twelve, in pairs, with odds of e^-15, one pair is 3 off: the rest has the estimate without it."""
    errors = GrossErrors(np.arange(COUNT).reshape(-1, 2), np.full(COUNT // 2, -15.0))
    noise = 0.1 * np.random.default_rng(1).normal(size=COUNT)
    observed, sigma = slopes @ (START + 0.3 * SCALE) + noise, np.full(COUNT, 0.1)
    off = observed + 3.0 * np.isin(np.arange(COUNT), (4, 5))
    found = estimate(linear(slopes), off, sigma, PARAMETERS, errors=errors)
    assert found.inflation == 1
    np.testing.assert_array_equal(np.flatnonzero(~found.kept), [4, 5])
    without = fitted(np.delete(slopes, [4, 5], axis=0), np.delete(observed, [4, 5]))
    np.testing.assert_allclose(found.values, without.values, rtol=1e-6)
    np.testing.assert_allclose(found.deviations, without.deviations, rtol=1e-6)
    np.testing.assert_allclose(found.residuals_without(np.array([4, 5])), found.residuals[[4, 5]])
    wrong = estimate(linear(slopes), observed + 300 * noise, sigma, PARAMETERS, errors=errors)
    assert wrong.inflation > 100
    assert wrong.kept.all()


def test_what_is_not_observed_is_held_by_its_prior(slopes):
    """Only the sum of the first two is observed."""
    tied = np.column_stack([slopes[:, 0], slopes[:, 0], slopes[:, 2]])
    parameters = [replace(parameter, start=0.0, scale=1.0) for parameter in PARAMETERS]
    found = fitted(tied, tied @ [0.4, 0.2, 5.0], 1e-4, parameters)
    np.testing.assert_allclose(found.values, [0.3, 0.3, 5.0], atol=1e-5)
    np.testing.assert_allclose(found.resolution, [0.5, 0.5, 1.0], atol=1e-5)
    nothing = fitted(0 * slopes, np.zeros(COUNT), 1.0, parameters)
    assert (nothing.resolution < 0.5).all()
    np.testing.assert_allclose(nothing.deviations, 1.0)


def test_fewer_observations_than_parameters(slopes):
    found = fitted(slopes[:2], slopes[:2] @ START)
    assert np.isfinite(found.intervals).all()


def test_what_is_left_out_is_what_a_refit_predicts(slopes):
    observed = slopes @ START + 0.1 * np.random.default_rng(4).normal(size=COUNT)
    found, rows = fitted(slopes, observed), np.array([4, 5])
    kept = np.delete(np.arange(COUNT), rows)
    refitted = fitted(slopes[kept], observed[kept])
    assert found.inflation == refitted.inflation == 1
    np.testing.assert_allclose(
        found.residuals_without(rows), (slopes[rows] @ refitted.values - observed[rows]) / 0.1, rtol=1e-6
    )


def test_a_curved_model_has_the_minimum_that_finite_differences_find():
    """A decay with a logarithmic parameter; the objective is written out here once more."""
    time, sigma = np.linspace(0, 2, 15), 0.02
    parameters = [Parameter("size", "", 1.0, 1.0), Parameter("rate", "1/s", 1.0, 0.7, logarithmic=True)]

    def model(values):
        size, rate = values
        decay = np.exp(-rate * time)
        return size * decay, np.column_stack([decay, -size * time * decay])

    observed = 1.6 * np.exp(-2.3 * time) + sigma * np.random.default_rng(5).normal(size=15)
    found = estimate(model, observed, np.full(15, sigma), parameters)

    def residuals(z):
        return np.append((model((1 + z[0], np.exp(0.7 * z[1])))[0] - observed) / sigma, z)

    dense = least_squares(residuals, [0.0, 0.0], jac="3-point", xtol=1e-12, ftol=1e-12, gtol=1e-12)
    np.testing.assert_allclose(found.values, [1 + dense.x[0], np.exp(0.7 * dense.x[1])], rtol=1e-6)
    np.testing.assert_allclose(found.covariance, np.linalg.inv(dense.jac.T @ dense.jac), rtol=1e-4)
    assert (found.intervals[1] > 0).all()


def test_bounds_hold(slopes):
    parameters = [*PARAMETERS[:2], replace(PARAMETERS[2], high=4.0)]
    found = fitted(slopes, slopes @ [1.0, -1.0, 9.0], 1.0, parameters)
    assert found.values[2] == pytest.approx(4.0, abs=1e-3)
    assert found.intervals[2, 1] <= 4.0


LENGTH = Parameter("length", "mm", 3.0, 0.5)
FACTOR = Parameter("factor", "", 2.0, 0.25, logarithmic=True)
ONE = Parameter("one", "", 0.0, 1.0)


@pytest.mark.parametrize("z", [-2.0, 0.0, 1.3])
def test_a_value_is_at_the_priors_quantile(z: float) -> None:
    share = norm.cdf(z)
    assert LENGTH.value(z) == pytest.approx(norm.ppf(share, loc=3.0, scale=0.5), rel=1e-12)
    assert FACTOR.value(z) == pytest.approx(lognorm.ppf(share, s=0.25, scale=2.0), rel=1e-12)


@pytest.mark.parametrize("parameter", [LENGTH, FACTOR])
def test_a_parameter_has_its_slope_and_at_its_bounds_their_values(parameter: Parameter) -> None:
    difference = (parameter.value(0.7 + 1e-6) - parameter.value(0.7 - 1e-6)) / 2e-6
    assert parameter.derivative(0.7) == pytest.approx(float(difference), rel=1e-8)
    low, high = replace(parameter, low=0.8, high=7.0).bounds
    np.testing.assert_allclose([parameter.value(low), parameter.value(high)], [0.8, 7.0], rtol=1e-12)


def test_a_positive_parameter_has_no_bound_at_zero_or_below() -> None:
    assert FACTOR.bounds == (-inf, inf)
    assert replace(FACTOR, low=0.0, high=2 * e**0.5).bounds == (-inf, pytest.approx(2.0, rel=1e-12))
    assert replace(FACTOR, low=0.5).bounds[0] == pytest.approx(np.log(0.25) / 0.25, rel=1e-12)


def as_found(sensitivities: FloatArray, inflation: float = 1.0, z: float = 0.0) -> Estimate:
    count, parameters = len(sensitivities), [LENGTH, FACTOR, ONE][: sensitivities.shape[1]]
    places = np.full(len(parameters), z)
    return Estimate(
        parameters,
        Prior.independent(len(parameters)),
        places,
        sensitivities,
        np.zeros(count),
        np.ones(count, dtype=bool),
        inflation,
        1,
        converged=True,
    )


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
    assert Prior.independent(matrix.shape[1]).freedom(matrix) == pytest.approx(7 - np.trace(hat), rel=1e-12)
    assert Prior.independent(3).freedom(1e6 * np.eye(3)) == 1


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


@pytest.mark.parametrize(
    ("start", "limits", "first"),
    [
        (None, {}, [0.0]),  # the prior's middle
        (0.19, {}, [1.9]),  # where it is told to
        (0.3, {"high": 2.5}, [3.0, 0.0]),  # where there is no prediction, at the prior's middle
        (0.3, {"low": 1.5}, [3.0]),  # a Newton step from 3 leads to 1.28, and is taken back
    ],
)
def test_the_search_begins_at_a_place_with_a_prediction_and_finds_the_value(start, limits, first) -> None:
    calls: list[float] = []
    found = searched(calls, **limits, start=None if start is None else np.array([start]))
    assert calls[: len(first)] == pytest.approx(first)
    assert found.values == pytest.approx([2.0], abs=0.01)
    assert found.converged
    assert found.evaluations == len(calls) == len(set(calls)), "once for every place"
    assert min(calls) < limits.get("low", np.inf)


def test_a_search_without_an_observation_may_meet_places_without_a_prediction() -> None:
    """There the residual of what is left out is infinite, and no number times nothing."""
    found = searched([], low=1.5, start=np.array([0.3]), kept=np.arange(4) > 0)
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


def test_what_was_learned_before_is_worth_as_much_as_the_observations_themselves(slopes):
    """Of a linear model: the posterior of six observations is the prior of six more, or all are fitted."""
    rng = np.random.default_rng(3)
    observed = slopes @ (START + SCALE * rng.normal(size=3)) + rng.normal(size=COUNT)

    def fitted(rows: slice, prior: Prior | None = None) -> Estimate:
        def model(values: FloatArray) -> tuple[FloatArray, FloatArray]:
            return slopes[rows] @ values, slopes[rows]

        return estimate(model, observed[rows], np.ones(COUNT)[rows], PARAMETERS, prior=prior, rounds=1)

    first, whole = fitted(slice(0, 6)), fitted(slice(0, COUNT))
    then = fitted(slice(6, COUNT), Prior(first.z, np.linalg.inv(first.covariance)))
    np.testing.assert_allclose(then.covariance, whole.covariance, rtol=1e-9)
    # A fit ends where its cost changes by 1e-4 of itself.
    np.testing.assert_allclose(then.z, whole.z, atol=1e-3)

"""Estimates of parameters against closed forms, refits, draws of noise and SciPy's finite differences."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import binom

from solvers.assimilation.estimation import Parameter, estimate

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


def test_intervals_cover_the_truth_as_often_as_they_say(slopes):
    """The band holds 99.9 % of the binomial; intervals 10 % too narrow fall below it."""
    random, draws, sigma = np.random.default_rng(2), 400, 0.1
    truth = START + 0.3 * SCALE
    inside = np.zeros(3)
    for _ in range(draws):
        found = fitted(slopes, slopes @ truth + sigma * random.normal(size=COUNT), sigma)
        inside += (found.intervals[:, 0] < truth) & (truth < found.intervals[:, 1])
    low, high = binom.interval(0.999, 3 * draws, 0.95)
    assert low <= inside.sum() <= high


def test_intervals_cover_where_the_standard_deviations_are_ten_times_too_small(slopes):
    """Student's t for what is left of the degrees of freedom."""
    random, draws, sigma = np.random.default_rng(3), 300, 0.01
    inside, inflations = 0, []
    for _ in range(draws):
        found = fitted(slopes, slopes @ START + sigma * random.normal(size=COUNT), sigma / 10)
        inside += int(((found.intervals[:, 0] < START) & (found.intervals[:, 1] > START)).sum())
        inflations.append(found.inflation)
    low, high = binom.interval(0.999, 3 * draws, 0.95)
    assert low <= inside <= high
    assert np.mean(inflations) == pytest.approx(10, rel=0.1)


def test_what_is_not_observed_is_held_by_its_prior(slopes):
    """Only the sum of the first two is observed."""
    tied = np.column_stack([slopes[:, 0], slopes[:, 0], slopes[:, 2]])
    parameters = [replace(parameter, start=0.0, scale=1.0) for parameter in PARAMETERS]
    found = fitted(tied, tied @ [0.4, 0.2, 5.0], 1e-4, parameters)
    np.testing.assert_allclose(found.values, [0.3, 0.3, 5.0], atol=1e-5)
    np.testing.assert_allclose(found.resolution, [0.5, 0.5, 1.0], atol=1e-5)
    np.testing.assert_allclose(np.abs(found.least_determined), [np.sqrt(0.5), np.sqrt(0.5), 0], atol=1e-6)
    assert found.least_determined[0] * found.least_determined[1] < 0
    assert found.singular_values[-1] < 1e-6
    nothing = fitted(0 * slopes, np.zeros(COUNT), 1.0, parameters)
    assert not nothing.resolved.any()
    np.testing.assert_allclose(nothing.deviations, 1.0)


def test_fewer_observations_than_parameters(slopes):
    found = fitted(slopes[:2], slopes[:2] @ START)
    assert found.singular_values.shape == (3,)
    assert found.singular_values[-1] == 0
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

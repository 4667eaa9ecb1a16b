"""Advice on what narrows the interval of an identified force, against the posterior with that measurement."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.solvers.fem.identification import FemBody, FemIdSolver
from pinnray.solvers.identification.fit import NORMAL
from pinnray.solvers.identification.model import MarkerData, MarkerModel
from pinnray.solvers.identification.narrowing import _places, _tried
from pinnray.solvers.identification.search import Identifier

STROKE = np.array([0.0, -1.0])


@pytest.fixture(scope="module")
def fit(identified):
    observed, _, solution = identified
    problem = replace(solution.problem, observations=None)
    solver = FemIdSolver(degree=1, law="given")
    return Identifier(solver, problem, lambda unknowns: FemBody(unknowns, 1)).identify(observed).best


def variance_with(fit, point):
    """Of the force, (N/mm)^2, with a marker more at a point, by the rows of a marker's own model."""
    data, found = fit.measurement, fit.estimate
    noise = found.inflation * np.median(data.deviations)
    marker = MarkerData(point[None], np.zeros((1, 2)), np.full((1, 2), noise), 0.01)
    rows = MarkerModel(fit.model, marker).predicted(fit.response)[1] * found.slopes / noise
    covariance = np.linalg.inv(np.linalg.inv(found.covariance) + rows.T @ rows)
    slopes = fit.response.force_slopes @ STROKE * found.slopes
    less = slopes @ (found.covariance - covariance) @ slopes
    return sum(fit.posterior.variances(STROKE).values()) - (found.quantile / NORMAL) ** 2 * less


def test_another_marker_leaves_the_variance_of_the_posterior_with_it(fit):
    """The best of the places that are tried, where a marker's disc is a point."""
    remedy = next(each for each in _tried(fit, STROKE) if each.name.startswith("another marker"))
    points, _ = _places(fit)
    variances = [variance_with(fit, point) for point in points]
    assert remedy.variance == pytest.approx(min(variances), rel=1e-3)  # of steps and of a small disc
    best = points[int(np.argmin(variances))]
    assert remedy.name == "another marker, at ({:.0f}, {:.0f}) mm".format(*best)
    assert remedy.variance < 0.9 * sum(fit.posterior.variances(STROKE).values())


def test_known_walls_leave_the_variance_of_the_posterior_without_them(fit):
    """That is of the precision's rows and columns of the other unknowns."""
    found, names = fit.estimate, fit.model.unknowns.names
    remedy = next(each for each in _tried(fit, STROKE) if each.name == "walls that are measured")
    kept = [row for row, name in enumerate(names) if not name.endswith("_thickness")]
    covariance = np.linalg.inv(np.linalg.inv(found.covariance)[np.ix_(kept, kept)])
    slopes = fit.response.force_slopes @ STROKE * found.slopes
    wider = (found.quantile / NORMAL) ** 2
    whole = sum(fit.posterior.variances(STROKE).values()) - wider * slopes @ found.covariance @ slopes
    assert remedy.variance == pytest.approx(whole + wider * slopes[kept] @ covariance @ slopes[kept])

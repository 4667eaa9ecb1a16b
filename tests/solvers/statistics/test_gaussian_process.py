"""`gp` against its own definition, and how it treats what it is not told."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern

from pinnray.runtime.errors import UserError
from pinnray.solvers.problem import Problem
from pinnray.solvers.statistics.gaussian_process import GaussianProcessSolver
from pinnray.solvers.statistics.posterior import Posterior, log_root_determinant
from tests.solvers.conftest import check_gradient, hiding, observed_at
from tests.solvers.statistics.kernels import matern


def observed(mesh, displacement, *, deviation=0.01, hidden=()):
    visible = ~np.isin(np.arange(len(mesh.markers)), hidden)
    return observed_at(mesh.markers, displacement(mesh.markers), deviation, visible)


def bump(points):
    """Something smooth with different lengths in u and v."""
    x = points[:, 0]
    return np.stack([np.sin(x / 25), 5 * np.exp(-(((x - 40) / 15) ** 2))], axis=1)


@pytest.fixture(scope="module")
def problem(coarse_mesh):
    return Problem(coarse_mesh, observations=observed(coarse_mesh, bump, hidden=(2,)))


@pytest.fixture(scope="module")
def solution(problem):
    return GaussianProcessSolver().solve(problem)


def conditioned(solution, points, given, *, axis):
    """Mean and variance of the process with its constants, by the textbook's equations 2.25 and 2.26."""
    observations = solution.problem.observations
    known, d = observations.points[given], observations.displacements[given, axis]
    variance, length = solution.field.variances[axis], solution.field.lengths[axis]

    def kernel(first, second):
        return variance * matern(first, second, length)

    inverse = np.linalg.inv(
        kernel(known, known) + np.diag(observations.standard_deviations[given, axis] ** 2)
    )
    across = kernel(points, known)
    return across @ inverse @ d, variance - np.einsum("ni,ij,nj->n", across, inverse, across)


def test_mean_and_deviation_are_those_of_the_process(solution, coarse_mesh):
    places = coarse_mesh.at_centroids()
    seen = solution.problem.observations.visible
    for axis in (0, 1):
        mean, variance = conditioned(solution, places.points, seen, axis=axis)
        np.testing.assert_allclose(solution.displacement(places)[:, axis], mean, atol=1e-6)
        deviation = solution.field.standard_deviation(places)[:, axis]
        np.testing.assert_allclose(deviation**2, variance, atol=1e-5)


def test_the_gradient_is_the_derivative_also_at_the_markers(solution, coarse_mesh):
    check_gradient(solution, np.concatenate([coarse_mesh.at_centroids().points[::60], coarse_mesh.markers]))


def test_the_constants_are_those_that_scikit_learn_finds(problem):
    """From its start in its ranges: 1e-6 of them, where the search ends at the flat top of the likelihood."""
    found = GaussianProcessSolver().solve(problem).field
    assert isinstance(found, Posterior)
    observations = problem.observations
    seen = observations.visible
    start = ConstantKernel(10.0, (1e-4, 1e6)) * Matern(30.0, (1.0, 1000.0), 2.5)
    for axis in (0, 1):
        process = GaussianProcessRegressor(start, alpha=observations.standard_deviations[seen, axis] ** 2)
        fitted = process.fit(observations.points[seen], observations.displacements[seen, axis])
        expected = np.exp(fitted.kernel_.theta)
        assert [found.variances[axis], found.lengths[axis]] == pytest.approx(expected, rel=1e-6)


def test_a_marker_that_is_left_out_has_no_say_at_all(problem, solution):
    """Solving again without it, and with another value for it: neither constants nor data come from it."""
    observations = problem.observations
    assert np.isnan(solution.left_out[2]).all()
    for marker in (0, 5):
        again = GaussianProcessSolver().solve(hiding(problem, marker))
        expected = again.displacement(observations.points[[marker]])[0]
        np.testing.assert_allclose(solution.left_out[marker], expected, atol=1e-8)


def test_it_knows_of_the_clamp_only_if_it_is_told(problem, coarse_mesh):
    shifted = replace(problem, observations=observed(coarse_mesh, lambda points: bump(points) + 4.0))
    base = coarse_mesh.points[np.unique(coarse_mesh.boundary("base"))]
    for clamp in (False, True):
        moved = np.abs(GaussianProcessSolver(clamp=clamp).solve(shifted).displacement(base)).max()
        assert bool(moved < 0.1) is clamp


def test_three_markers_will_do_where_none_is_left_out(coarse_mesh):
    few = observed(coarse_mesh, bump, hidden=(0, 1, 2, 3, 4, 5))
    with pytest.raises(UserError, match="needs 4 that were seen, not 3"):
        GaussianProcessSolver().solve(Problem(coarse_mesh, observations=few))
    assert GaussianProcessSolver().refitter(Problem(coarse_mesh))(few).left_out is None


def test_the_evidence_is_that_of_the_normal_distribution(problem):
    solution = GaussianProcessSolver().solve(problem)
    assert isinstance(solution.field, Posterior)
    observations = problem.observations
    seen = observations.visible
    points, expected = observations.points[seen], 0.0
    for axis in (0, 1):
        variance, length = solution.field.variances[axis], solution.field.lengths[axis]
        covariance = variance * matern(points, points, length)
        covariance += np.diag(observations.standard_deviations[seen, axis] ** 2)
        expected += multivariate_normal.logpdf(observations.displacements[seen, axis], cov=covariance)
    assert solution.stats["log_evidence"] == pytest.approx(expected, abs=1e-4)


def test_the_determinant_is_the_same_to_the_bit_whatever_lies_beside_the_matrix() -> None:
    """NumPy takes a diagonal's logarithms one by one if their array follows the matrix, else many at once.

    Where it can take many at once, some of these matrices show it.
    """
    generator = np.random.default_rng(2)
    for _ in range(200):
        root = np.tril(generator.random((18, 18))) + np.eye(18)
        found = log_root_determinant(root)
        assert found == sum(math.log(root[row, row]) for row in range(18))
        assert found == pytest.approx(np.linalg.slogdet(root @ root.T)[1] / 2, rel=1e-12)

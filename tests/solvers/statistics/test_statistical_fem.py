"""`statfem` against conditioning by hand, and against data that its own model has made."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.statistics.statistical_fem import StatFemSolver
from pinnray.solvers.statistics.statistical_posterior import log_root_determinant, minus_log_likelihood
from tests.solvers.conftest import check_gradient, hiding, observed_at
from tests.solvers.statistics.kernels import matern


@pytest.fixture(scope="module")
def units(coarse_mesh):
    """`fem` under a unit displacement of the contact along u, and along v."""
    fem = FemSolver(estimate=False)
    return [
        fem.solve(Problem(coarse_mesh, load=Load(displacement=unit))) for unit in ((1.0, 0.0), (0.0, 1.0))
    ]


def observing(mesh, displacements, *, deviation=0.01, hidden=()):
    visible = ~np.isin(np.arange(len(mesh.markers)), hidden)
    return Problem(mesh, observations=observed_at(mesh.markers, displacements, deviation, visible))


@pytest.fixture(scope="module")
def problem(coarse_mesh, units):
    """A load that is off, and a discrepancy that no load explains."""
    x = coarse_mesh.markers[:, :1]
    lacking = 0.3 * np.concatenate([np.sin(x / 12), np.cos(x / 15)], axis=1)
    made = sum(
        part * unit.displacement(coarse_mesh.markers) for part, unit in zip((-1.0, -9.5), units, strict=True)
    )
    return observing(coarse_mesh, made + lacking, hidden=(4,))


SOLVER = StatFemSolver(stroke_deviation=0.7)


@pytest.fixture(scope="module")
def solution(problem):
    return SOLVER.solve(problem)


def by_hand(solution, units, points):
    """Mean and variance of ρ u + δ at points by the normal distribution of all unknowns and data at once."""
    problem, stats = solution.problem, solution.stats
    seen = problem.observations.visible
    everywhere = np.concatenate([problem.observations.points[seen], points])
    spreads = np.array([stats["discrepancy_u"], stats["discrepancy_v"]])
    shapes = np.stack([unit.displacement(everywhere).ravel() for unit in units], axis=1) * stats["factor"]
    prior = SOLVER.stroke_deviation**2 * shapes @ shapes.T
    prior = prior + np.kron(matern(everywhere, everywhere, stats["length"]), np.diag(spreads**2))
    mean = shapes @ problem.load.values
    given = 2 * seen.sum()
    noise = np.diag(problem.observations.standard_deviations[seen].ravel() ** 2)
    gain = prior[given:, :given] @ np.linalg.inv(prior[:given, :given] + noise)
    mean = mean[given:] + gain @ (problem.observations.displacements[seen].ravel() - mean[:given])
    variance = np.diag(prior[given:, given:] - gain @ prior[:given, given:])
    return mean.reshape(-1, 2), variance.reshape(-1, 2)


def test_mean_and_deviation_are_those_of_the_posterior(solution, units, coarse_mesh):
    places = coarse_mesh.at_centroids()
    places = coarse_mesh.locate(places.points[::30])
    mean, variance = by_hand(solution, units, places.points)
    np.testing.assert_allclose(solution.displacement(places), mean, atol=1e-8)
    np.testing.assert_allclose(solution.field.standard_deviation(places) ** 2, variance, atol=1e-9)


def test_gradient_is_the_derivative(solution, coarse_mesh):
    check_gradient(solution, coarse_mesh.at_centroids().points[::60])


def test_no_other_constants_are_more_likely(solution, units):
    """The likelihood by SciPy's normal density, about the constants that were found."""
    from scipy.stats import multivariate_normal

    problem, stats = solution.problem, solution.stats
    seen = problem.observations.visible
    points = problem.observations.points[seen]
    noise = problem.observations.standard_deviations[seen].ravel() ** 2
    shapes = np.stack([unit.displacement(points).ravel() for unit in units], axis=1)

    def log_likelihood(factor, u, v, length):
        covariance = (factor * SOLVER.stroke_deviation) ** 2 * shapes @ shapes.T + np.diag(noise)
        covariance += np.kron(matern(points, points, length), np.diag([u**2, v**2]))
        mean = factor * shapes @ problem.load.values
        return multivariate_normal.logpdf(problem.observations.displacements[seen].ravel(), mean, covariance)

    found = np.array([stats[name] for name in ("factor", "discrepancy_u", "discrepancy_v", "length")])
    best = log_likelihood(*found)
    assert stats["log_evidence"] == pytest.approx(best, abs=1e-6)
    for change in 1 + 0.05 * np.concatenate([np.eye(4), -np.eye(4)]):
        assert log_likelihood(*(found * change)) < best


def test_the_likelihood_falls_as_its_derivatives_say(solution):
    data = solution.field.posterior.data
    for place in ([0.1, -1.0, -2.0, 3.0], [-0.2, 0.3, -1.0, 2.5]):
        _, slopes = minus_log_likelihood(data, np.array(place))
        expected = approx_fprime(np.array(place), lambda at: minus_log_likelihood(data, at)[0])
        np.testing.assert_allclose(slopes, expected, rtol=1e-4)


def test_a_marker_that_is_left_out_has_no_say_at_all(problem, solution):
    observations = problem.observations
    assert np.isnan(solution.left_out[4]).all()
    expected = SOLVER.solve(hiding(problem, 7)).displacement(observations.points[[7]])[0]
    np.testing.assert_allclose(solution.left_out[7], expected, atol=1e-8)


@pytest.mark.parametrize("load", [Load(displacement=(None, -10.0)), Load(kind="patch")])
def test_a_component_that_is_free_has_no_load(problem, load):
    solution = SOLVER.solve(replace(problem, load=load))
    assert ("load_u" in solution.stats) is (load.displacement[0] is not None)
    observations = problem.observations
    missed = (solution.displacement(observations.points) - observations.displacements)[observations.visible]
    assert np.abs(missed).max() < 0.03


def test_without_markers_it_is_fem(coarse_mesh):
    problem = Problem(coarse_mesh)
    solution = StatFemSolver().solve(problem)
    assert solution.field.values.tolist() == FemSolver().solve(problem).field.values.tolist()  # type: ignore[attr-defined]
    assert (solution.solver, solution.left_out) == ("statfem", None)


def test_at_finite_strain_its_own_model_is_reproduced(coarse_mesh):
    """Markers of `fem-nonlinear` leave nothing for the discrepancy; the force is that of sections."""
    material = Material(law="neo-hookean")
    plain = Problem(coarse_mesh, material, Load(displacement=(-0.5, -5.0)))
    exact = FemNonlinearSolver(degree=1).solve(plain)
    moved = exact.displacement(coarse_mesh.markers)
    observed = observing(coarse_mesh, moved, deviation=0.001).observations
    solution = StatFemSolver(degree=1, stroke_deviation=0.01).solve(replace(plain, observations=observed))
    inside = coarse_mesh.at_centroids()
    # The load's prior and the noise leave some micrometres.
    np.testing.assert_allclose(solution.displacement(inside), exact.displacement(inside), atol=0.01)
    # Sections of linear elements transmit the force to some per cent.
    np.testing.assert_allclose(solution.reaction, exact.reaction, atol=0.1 * np.linalg.norm(exact.reaction))
    assert solution.energy == pytest.approx(exact.energy, rel=0.01)
    assert solution.problem.material.law == "neo-hookean"


def test_at_finite_strain_the_second_component_is_a_tangent(coarse_mesh):
    """Half a millimetre along the finger more than the nominal load: found, to the square of it."""
    material = Material(law="neo-hookean")
    other = Problem(coarse_mesh, material, Load(displacement=(-0.5, -5.0)))
    exact = FemNonlinearSolver(degree=1).solve(other)
    observed = observing(coarse_mesh, exact.displacement(coarse_mesh.markers), deviation=0.001).observations
    nominal = replace(other, load=Load(displacement=(0.0, -5.0)), observations=observed)
    solution = StatFemSolver(degree=1).solve(nominal)
    assert solution.stats["load_u"] * solution.stats["factor"] == pytest.approx(-0.5, abs=0.1)


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

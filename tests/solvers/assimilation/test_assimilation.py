"""The misfit to the markers: its units, its derivative, and what each weighting means."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from pinnray.geometry.finger.presets import load_design
from pinnray.solvers.assimilation.misfit import (
    MarkerSettings,
    disc_quadrature,
    leave_one_out_displacements,
    radius_within,
)
from pinnray.solvers.problem import Problem
from pinnray.solvers.registry import make_solver
from tests.solvers.conftest import observed_at


@pytest.fixture
def problem(coarse_mesh):
    """Nine markers, of which the third was not seen."""
    points, random = coarse_mesh.markers, np.random.default_rng(3)
    displacements = random.normal(size=points.shape)
    displacements[2] = 1e6
    deviations = random.uniform(0.01, 0.1, points.shape)
    deviations[0] = 0.0
    seen = observed_at(points, displacements, deviations, np.arange(len(points)) != 2)
    return Problem(coarse_mesh, observations=seen)


def test_no_observations_no_misfit(coarse_mesh):
    assert MarkerSettings().misfit(Problem(coarse_mesh)) is None


def test_paper_weights_are_its_loss_times_the_area(problem):
    """λ_ASM (1/N) Σ |u - d|² as the paper prints it, summed in a loop, over the markers seen."""
    observations = problem.observations
    seen = [marker for marker in range(9) if observations.visible[marker]]
    moved = np.random.default_rng(1).normal(size=(len(seen), 2))
    loss = sum(
        (u - observations.displacements[marker, 0]) ** 2 + (v - observations.displacements[marker, 1]) ** 2
        for marker, (u, v) in zip(seen, moved, strict=True)
    ) / len(seen)
    misfit = MarkerSettings(asm_weight=7.0).misfit(problem)
    assert misfit.value(moved) == pytest.approx(problem.mesh.areas.sum() * 7.0 * loss, rel=1e-12)


def test_precision_weights_are_the_log_likelihood_times_the_scale(problem):
    """The density of the errors by SciPy, whose logarithm falls by the misfit over the scale."""
    from scipy.stats import norm

    misfit = MarkerSettings(weights="precision", scale=0.3).misfit(problem)
    seen = problem.observations.visible
    deviations = np.maximum(problem.observations.standard_deviations[seen], 0.005)
    assert deviations.min() == 0.005, "the smallest that counts"
    fall = (norm.logpdf(0, scale=deviations) - norm.logpdf(0.02, scale=deviations)).sum()
    assert misfit.value(misfit.observed + 0.02) == pytest.approx(0.3 * fall, rel=1e-9)


@pytest.mark.parametrize("weights", ["paper", "precision"])
def test_the_gradient_of_the_misfit_is_the_weighted_residual(problem, weights):
    """Taylor's remainder of a quadratic is the misfit of the step itself, for any step."""
    misfit = MarkerSettings(weights=weights).misfit(problem)
    random = np.random.default_rng(5)
    moved, step = random.normal(size=(2, *misfit.observed.shape))
    slope = -(misfit.weights * (misfit.observed - moved) * step).sum()
    for size in (1.0, 1e-3):
        rise = misfit.value(moved + size * step) - misfit.value(moved) - size * slope
        assert rise == pytest.approx(size**2 * misfit.value(misfit.observed + step), rel=1e-6)


def test_a_prediction_without_a_marker_is_what_was_seen_less_the_residual(problem):
    given = problem.observations
    residuals = np.random.default_rng(0).normal(size=(len(given.visible) - 1, 2))
    predicted = leave_one_out_displacements(problem, residuals)
    assert np.isnan(predicted[2]).all()
    others = np.delete(given.displacements, 2, axis=0) - residuals
    np.testing.assert_allclose(np.delete(predicted, 2, axis=0), others, rtol=1e-15)


def test_a_marker_moves_by_the_mean_over_its_disc(problem):
    """That of x^2 y over a disc around (a, b) is a^2 b + b r^2 / 4, of a square distance more by r^2 / 2."""
    misfit = MarkerSettings(marker_radius=0.5).misfit(problem)
    points, shares = MarkerSettings(marker_radius=0.0).misfit(problem).sampling()
    np.testing.assert_array_equal(shares @ points, misfit.points)  # without a radius the centre
    (x, y), shares = misfit.sampling()[0].T, misfit.sampling()[1]
    a, b = misfit.points.T
    np.testing.assert_allclose(shares @ (x**2 * y), a**2 * b + b * 0.5**2 / 4, rtol=1e-12)
    np.testing.assert_allclose(shares @ ((x - 1) ** 2 + y**2), (a - 1) ** 2 + b**2 + 0.5**2 / 2, rtol=1e-12)


def test_the_mean_over_a_disc_is_that_of_polynomials():
    """The rule's four rings and twelve angles take the mean of every polynomial of degree 8 exactly."""
    centres, radius = np.array([[1.0, 2.0], [-3.0, 0.5]]), 0.7
    points, weights = disc_quadrature(centres, radius)
    x, y = (points - centres[0]).T
    exact = {(0, 0): 1, (1, 0): 0, (0, 1): 0, (2, 0): 1 / 4, (1, 1): 0, (2, 2): 1 / 24, (4, 0): 1 / 8}
    exact |= {(6, 0): 5 / 64, (0, 8): 7 / 128, (4, 4): 3 / 640, (5, 3): 0}
    for (i, j), mean in exact.items():
        scaled = (x / radius) ** i * (y / radius) ** j
        assert weights[0] @ scaled == pytest.approx(mean, abs=1e-14), (i, j)
    np.testing.assert_allclose(weights @ points, centres, atol=1e-14)


def test_a_disc_is_as_large_as_the_distance_from_the_boundary(coarse_mesh):
    """The distance is shapely's, also where an edge that is lengthened would be nearer."""
    edges = coarse_mesh.points[coarse_mesh.boundary_edges]
    boundary = shapely.multilinestrings(shapely.linestrings(edges))
    for point in coarse_mesh.points[coarse_mesh.triangles[::7]].mean(axis=1):
        distance = shapely.distance(boundary, shapely.points(point))
        assert radius_within(coarse_mesh, point[None], 100.0) == pytest.approx(distance, rel=1e-12)
    assert radius_within(coarse_mesh, coarse_mesh.markers, 1e-3) == 1e-3


def test_a_disc_does_not_reach_beyond_the_body(problem):
    """The markers are in the middle of a wall of 2 mm."""
    assert MarkerSettings().misfit(problem).radius == 0.8
    assert MarkerSettings(marker_radius=3.0).misfit(problem).radius == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("preset", ["default", "slender"])
@pytest.mark.parametrize("name", ["fem-asm", "pinn-asm"])
def test_the_disc_is_that_of_the_designs_markers(problem, preset, name):
    radius = load_design(preset).marker_diameter / 2
    observed = replace(problem, observations=replace(problem.observations, marker_radius=radius))
    assert make_solver(name).misfit(observed).radius == radius  # type: ignore[attr-defined]
    assert make_solver(name, marker_radius=0.3).misfit(observed).radius == 0.3  # type: ignore[attr-defined]

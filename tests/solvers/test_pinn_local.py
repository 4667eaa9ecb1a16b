"""`pinn-local`: windows that sum to one, graded points, and its distance from finite elements."""

import numpy as np
import pytest

from geometry.cache import finger_mesh
from geometry.design import Design
from geometry.errors import UserError
from geometry.quadrature import body_quadrature
from geometry.settings import MeshSettings
from solvers.fem.linear import FemSolver
from solvers.pinn.grading import (
    Spacing,
    graded_quadrature,
    graded_triangles,
    mean_thickness,
    singular_points,
    spread_points,
)
from solvers.pinn.local import PinnLocalSolver
from solvers.pinn.local_units import LocalField, LocalUnits
from solvers.pinn.trial_space import BaseFactor
from solvers.problem import Problem
from tests.solvers.conftest import bar_mesh


@pytest.fixture(scope="module")
def spacing(coarse_mesh) -> Spacing:
    return Spacing(singular_points(coarse_mesh), wall=1.0, corner=0.1, growth=0.3)


@pytest.fixture(scope="module")
def units(coarse_mesh, spacing) -> LocalUnits:
    centres = spread_points(graded_triangles(coarse_mesh, spacing, 0.6), coarse_mesh, spacing, 0.75)
    return LocalUnits.around(
        centres,
        1.8 * spacing.at(centres),
        ridges=3,
        slope=0.7,
        factor=BaseFactor.of(coarse_mesh, 5.0),
        rng=np.random.default_rng(0),
    )


def test_singular_points_are_the_cells_corners_and_the_bases_ends(coarse_mesh):
    found = singular_points(coarse_mesh)
    assert len(found) == 5 * 4 + 2
    for corner in ([2.0, -2.0], [70.0, -2.0], [0.0, 0.0], [0.0, -30.0]):
        assert np.linalg.norm(found - corner, axis=1).min() < 1e-9


def test_mean_thickness_of_a_long_bar_is_its_height():
    mesh = bar_mesh(400.0, 2.0, 200, 2, contact=(0.0, 4.0))
    assert mean_thickness(mesh) == pytest.approx(2 * 400 * 2 / (2 * 402), rel=1e-12)


def test_cut_triangles_keep_the_area_and_meet_the_spacing(coarse_mesh, spacing):
    triangles = graded_triangles(coarse_mesh, spacing, 0.6)
    points, weights = graded_quadrature(triangles, 2)
    assert weights.sum() == pytest.approx(coarse_mesh.areas.sum(), rel=1e-12)
    x, y = points.T
    rule = body_quadrature(coarse_mesh, 2)
    expected = (rule.weights * rule.location.points[:, 0] * rule.location.points[:, 1]).sum()
    assert (weights * x * y).sum() == pytest.approx(expected, rel=1e-12)
    longest = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(axis=1)
    assert (longest <= 0.6 * spacing.at(triangles.mean(axis=1))).all()


def test_spread_points_keep_their_distance_and_leave_no_hole(coarse_mesh, spacing):
    centres = spread_points(graded_triangles(coarse_mesh, spacing, 0.6), coarse_mesh, spacing, 0.75)
    gaps = np.linalg.norm(centres[:, None] - centres[None], axis=2) + 1e9 * np.eye(len(centres))
    assert (gaps.min(axis=1) > 0.75 * 0.6 * spacing.at(centres)).all()
    nearest = np.linalg.norm(coarse_mesh.points[:, None] - centres[None], axis=2).min(axis=1)
    assert (nearest <= 0.75 * spacing.at(coarse_mesh.points) * 1.3).all()


def test_windows_sum_to_one(units, coarse_mesh):
    """With output weights on the constants alone the network is the base factor times a constant."""
    output = np.zeros((units.count, 2))
    output[:: units.slopes.shape[1] + 1] = [2.0, -3.0]
    location = coarse_mesh.at_centroids()
    factor, _ = units.factor.at(location.points)
    np.testing.assert_allclose(
        LocalField(units, output).displacement(location), factor * [2.0, -3.0], rtol=1e-12
    )


def test_derivatives_are_those_of_differences(units, coarse_mesh):
    points = coarse_mesh.at_centroids().points[::10]
    step = 1e-6
    matrices = units.matrices(points)
    for axis, derivative in ((0, matrices.along_x), (1, matrices.along_y)):
        shift = step * np.eye(2)[axis]
        difference = (units.matrices(points + shift).values - units.matrices(points - shift).values) / (
            2 * step
        )
        assert abs(difference - derivative).max() < 1e-5


def test_a_point_in_no_window_is_refused(units):
    with pytest.raises(UserError, match="lie in no window"):
        units.matrices(np.array([[1.0, 500.0]]))


@pytest.mark.slow
def test_displacement_is_within_a_fifth_of_a_percent_of_finite_elements():
    """Against quadratic elements graded to 0.02 mm at the corners; 0.05 % is usual."""
    mesh = finger_mesh(Design())
    graded = finger_mesh(Design(), settings=MeshSettings(corner_size=0.02))
    network, reference = PinnLocalSolver().solve(Problem(mesh)), FemSolver().solve(Problem(graded))
    rule = body_quadrature(mesh)
    exact = reference.displacement(rule.location.points)
    difference = network.displacement(rule.location) - exact
    total = (rule.weights[:, None] * exact**2).sum()
    assert np.sqrt((rule.weights[:, None] * difference**2).sum() / total) < 0.002
    assert network.status.converged, network.status.message
    assert network.energy == pytest.approx(reference.energy, rel=0.01)
    assert network.energy > reference.energy
    assert np.abs(network.displacement(mesh.markers) - reference.displacement(mesh.markers)).mean() < 0.01


def test_too_few_windows_are_reported_as_not_converged(coarse_mesh):
    solution = PinnLocalSolver(wall_spacing=1.2, corner_spacing=0.5, ridges=2).solve(Problem(coarse_mesh))
    assert not solution.status.converged
    assert "take a smaller spacing" in solution.status.message


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"ridges": 1}, "ridges >= 2"),  # one ridge and a constant cannot follow a linear field
        ({"wall_spacing": 0.0}, "wall_spacing must be positive, got 0"),
        ({"coarser": 1.0}, "coarser > 1"),  # two equal levels would always agree
    ],
)
def test_bad_settings_are_refused(settings, message):
    with pytest.raises(UserError, match=message):
        PinnLocalSolver(**settings)

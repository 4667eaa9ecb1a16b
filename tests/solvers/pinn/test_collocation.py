"""Collocation points against the body that they stand for."""

import numpy as np
import pytest

from solvers.pinn.paper.collocation import base_points, collocation_points


@pytest.mark.parametrize("kind", ["nodes", "elements", "random"])
def test_shares_make_a_mean(coarse_mesh, kind):
    points, shares = collocation_points(coarse_mesh, kind, 0)
    assert shares.sum() == pytest.approx(1.0, rel=1e-12)
    assert len(coarse_mesh.locate(points)) == len(points), "all in the body"


def test_elements_integrate_and_random_points_estimate(coarse_mesh):
    """The mean of x² over the body exactly; random points err by the deviation over √n, some 2 %."""
    corners = coarse_mesh.points[coarse_mesh.triangles, 0]
    exact = (corners**2).sum(axis=1) + (corners[:, [1, 2, 0]] * corners).sum(axis=1)
    mean = (coarse_mesh.areas * exact / 6).sum() / coarse_mesh.areas.sum()
    for kind, tolerance in (("elements", 1e-12), ("random", 0.08)):
        points, shares = collocation_points(coarse_mesh, kind, 0)
        assert (shares * points[:, 0] ** 2).sum() == pytest.approx(mean, rel=tolerance), kind


def test_nodes_are_those_of_the_mesh_and_alike(coarse_mesh):
    points, shares = collocation_points(coarse_mesh, "nodes", 0)
    np.testing.assert_array_equal(points, coarse_mesh.points)
    assert len(set(shares)) == 1


def test_base_points_are_evenly_spaced_over_the_whole_base(coarse_mesh):
    points = base_points(coarse_mesh, 31)
    np.testing.assert_allclose(points[:, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.sort(points[:, 1]), np.linspace(-30, 0, 31), atol=1e-9)

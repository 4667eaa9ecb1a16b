"""The distance from the base in a network's hard condition, on bases of every kind."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from pinnray.solvers.pinn.finite_basis.hard_constraint import CurveDistance, LineDistance, base_distance
from tests.solvers.bodies import BODIES, body_mesh


def at(distance, points: np.ndarray) -> list[np.ndarray]:
    """A distance and its derivatives at points, each (n, 1)."""
    return [each.numpy() for each in distance.at(torch.from_numpy(np.array(points)))]


def test_a_straight_base_with_the_body_on_one_side_has_the_distance_from_its_line(coarse_mesh):
    found = base_distance(coarse_mesh)
    assert found == LineDistance((1.0, 0.0), 0.0)
    distance, along_x, along_y = at(found, coarse_mesh.points)
    np.testing.assert_array_equal(distance[:, 0], coarse_mesh.points[:, 0])
    assert set(along_x.ravel()) == {1.0}
    assert set(along_y.ravel()) == {0.0}


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("beam", LineDistance),
        ("tilted wedge", LineDistance),
        ("feet and slot", LineDistance),  # both feet stand on one line
        ("ring", CurveDistance),
        ("arch", CurveDistance),  # two pieces on two lines
    ],
)
def test_the_distance_vanishes_on_the_base_and_nowhere_else(name, kind):
    mesh = body_mesh(name, 1.0)
    distance = base_distance(mesh)
    assert isinstance(distance, kind)
    base = np.unique(mesh.boundary("base"))
    values = at(distance, mesh.points)[0][:, 0]
    assert np.abs(values[base]).max() < 1e-9
    assert np.delete(values, base).min() > 0.1, "elements of 1 mm"
    middles = mesh.points[mesh.boundary("base")].mean(axis=1)
    assert np.abs(at(distance, middles)[0]).max() < 1e-9


def test_a_line_that_the_body_crosses_elsewhere_clamps_no_other_point():
    """Of two feet on one line only one is clamped."""
    mesh = body_mesh("feet and slot", 1.0)
    edges = mesh.boundary("base")
    upper = edges[mesh.points[edges].mean(axis=1)[:, 1] > -10]
    one_foot = replace(mesh, boundaries={**mesh.boundaries, "base": upper})
    distance = base_distance(one_foot)
    assert isinstance(distance, CurveDistance)
    free = np.setdiff1d(edges, upper)
    assert at(distance, mesh.points[free])[0].min() > 10


@pytest.mark.parametrize("name", ["ring", "arch"])
def test_near_the_base_it_is_the_distance_with_the_normal_for_its_gradient(name):
    mesh = body_mesh(name, 0.5)
    distance = base_distance(mesh)
    edges = mesh.boundary_edges
    base = set(map(tuple, np.sort(mesh.boundary("base"), axis=1).tolist()))
    ends = mesh.points[np.array([edge for edge in edges.tolist() if tuple(sorted(edge)) in base])]
    along = ends[:, 1] - ends[:, 0]
    normal = np.column_stack([-along[:, 1], along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    for depth in (0.0, 1e-9, 1e-4):
        found, *slopes = at(distance, ends.mean(axis=1) + depth * normal)
        np.testing.assert_allclose(found[:, 0], depth, rtol=1e-3, atol=1e-9)
        np.testing.assert_allclose(np.column_stack(slopes), normal, atol=5e-3)


@pytest.mark.slow
def test_the_slopes_are_those_of_differences():
    mesh = body_mesh("ring", 1.0)
    distance = base_distance(mesh)
    points = torch.from_numpy(mesh.at_centroids().points.copy())
    _, *slopes = distance.at(points)
    for axis, slope in enumerate(slopes):
        shift = 1e-6 * torch.eye(2, dtype=torch.float64)[axis]
        difference = (distance.at(points + shift)[0] - distance.at(points - shift)[0]) / 2e-6
        torch.testing.assert_close(slope, difference, rtol=1e-5, atol=1e-7)


def test_the_distance_does_not_depend_on_how_a_base_is_cut_into_edges():
    once = CurveDistance(np.array([[[0.0, 0.0], [0.0, -6.0]], [[1.0, -9.0], [1.0, -12.0]]]))
    cuts = np.linspace(0, -6, 14)
    line = np.column_stack([0 * cuts, cuts])
    pieces = np.stack([line[:-1], line[1:]], axis=1)
    often = CurveDistance(np.concatenate([pieces, once.segments[1:]]))
    points = np.random.default_rng(0).uniform([0.1, -12], [8, 2], (50, 2))
    for first, second in zip(at(once, points), at(often, points), strict=True):
        np.testing.assert_allclose(first, second, rtol=1e-10)


@pytest.mark.parametrize("name", BODIES)
def test_it_is_finite_on_the_base_and_at_its_ends_too(name):
    mesh = body_mesh(name, 1.0)
    assert np.isfinite(at(base_distance(mesh), mesh.points)).all()

"""Quadrature against integrals in closed form."""

from math import factorial

import numpy as np
import pytest

from pinnray.geometry import TriangleMesh, body_quadrature, edge_quadrature
from pinnray.geometry.mesh.quadrature import triangle_rule

DEGREES = [1, 2, 3, 4]


@pytest.mark.parametrize("degree", DEGREES)
def test_rule_is_exact_up_to_its_degree(degree: int) -> None:
    points, weights = triangle_rule(degree)
    for i in range(degree + 1):
        for j in range(degree + 1 - i):
            # Integral of x^i y^j over the triangle (0,0), (1,0), (0,1), over its area 1/2.
            exact = 2 * factorial(i) * factorial(j) / factorial(i + j + 2)
            assert weights @ (points[:, 1] ** i * points[:, 2] ** j) == pytest.approx(exact, rel=1e-13)


@pytest.mark.parametrize(("degree", "rule"), [(2, 1), (3, 2), (5, 4)])
def test_rule_is_not_exact_above_its_degree(degree: int, rule: int) -> None:
    points, weights = triangle_rule(rule)
    exact = 2 * factorial(degree) / factorial(degree + 2)
    assert abs(weights @ points[:, 1] ** degree - exact) > 1e-6


@pytest.mark.slow
def test_weights_over_the_body_sum_to_its_area(mesh: TriangleMesh) -> None:
    for degree in DEGREES:
        assert body_quadrature(mesh, degree).weights.sum() == pytest.approx(mesh.areas.sum(), rel=1e-13)


def test_body_integral_of_a_polynomial_is_that_of_its_boundary(default_mesh: TriangleMesh) -> None:
    # Divergence theorem: the integral of x^3 y over the body is that of x^4 y / 4 n_x over its boundary.

    rule = body_quadrature(default_mesh, 4)
    x, y = rule.location.points.T
    edges = default_mesh.boundary_edges
    start, end = default_mesh.points[edges[:, 0]], default_mesh.points[edges[:, 1]]
    abscissae, weights = np.polynomial.legendre.leggauss(4)
    total = 0.0
    for s, w in zip(0.5 * (1 + abscissae), 0.5 * weights, strict=True):
        px, py = (start + s * (end - start)).T
        total += w * (px**4 * py / 4 * (end - start)[:, 1]).sum()
    assert rule.weights @ (x**3 * y) == pytest.approx(total, rel=1e-11)


@pytest.mark.parametrize("count", [1, 2, 4])
def test_edge_rule_is_exact_up_to_degree_two_n_less_one(default_mesh: TriangleMesh, count: int) -> None:
    points, weights = edge_quadrature(default_mesh, "front", points_per_edge=count)
    assert (points[:, 1] == 0).all()
    for power in range(2 * count):
        assert weights @ points[:, 0] ** power == pytest.approx(90 ** (power + 1) / (power + 1), rel=1e-12)


def test_edge_rule_of_the_contact_measures_its_width(default_mesh: TriangleMesh) -> None:
    points, weights = edge_quadrature(default_mesh, "contact")
    assert weights.sum() == pytest.approx(2, rel=1e-12)
    assert weights @ points[:, 0] / weights.sum() == pytest.approx(35, rel=1e-12)

"""Lagrange elements in NumPy: they reproduce polynomials of their degree."""

import numpy as np
import pytest

from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.solvers.lagrange import LagrangeField, LagrangeSpace
from tests.meshes import permuted


@pytest.mark.parametrize("degree", [1, 2])
def test_polynomials_of_the_degree_are_reproduced_with_their_gradient(coarse_mesh, degree):
    space = LagrangeSpace(permuted(coarse_mesh, 3), degree)
    x, y = space.nodes.T
    curved = degree - 1
    field = LagrangeField(
        space, np.column_stack([1 + 2 * x - y + curved * x * y, 3 * y - x + curved * (x**2 - 2 * y**2)])
    )
    location = body_quadrature(space.mesh, 4).location
    x, y = location.points.T
    expected = np.column_stack([1 + 2 * x - y + curved * x * y, 3 * y - x + curved * (x**2 - 2 * y**2)])
    np.testing.assert_allclose(field.displacement(location), expected, rtol=1e-12, atol=1e-9)
    gradient = np.array([[2 + curved * y, -1 + curved * x], [-1 + curved * 2 * x, 3 - curved * 4 * y]])
    np.testing.assert_allclose(field.gradient(location), gradient.transpose(2, 0, 1), rtol=1e-9, atol=1e-9)


def test_boundary_nodes_hold_the_edges_middles(coarse_mesh):
    space = LagrangeSpace(coarse_mesh, 2)
    nodes = space.boundary_nodes("base")
    assert len(nodes) == 2 * len(coarse_mesh.boundary("base")) + 1
    assert np.abs(space.nodes[nodes, 0]).max() < 1e-12

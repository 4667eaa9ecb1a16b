"""Random gates: their derivatives, and what more of them gain."""

import itertools

import numpy as np
import pytest

from benchmarks.random_gates import random_gates
from solvers.fem.linear import FemSolver
from solvers.problem import Problem

pytestmark = pytest.mark.slow


def test_more_units_are_nearer_to_finite_elements_and_gradients_are_differences(coarse_mesh):
    problem, place = Problem(coarse_mesh), coarse_mesh.at_centroids()
    exact = FemSolver().solve(problem).displacement(place)
    first, second = itertools.islice(random_gates(problem), 2)
    errors = [
        np.linalg.norm(field.displacement(place) - exact) / np.linalg.norm(exact) for field in (first, second)
    ]
    assert errors[1] < errors[0] < 0.2
    step = 1e-5
    for axis in range(2):
        shift = step * np.eye(2)[axis]
        ahead, behind = (
            second.displacement(coarse_mesh.locate(coarse_mesh.markers + sign * shift)) for sign in (1, -1)
        )
        gradient = second.gradient(coarse_mesh.locate(coarse_mesh.markers))[:, :, axis]
        np.testing.assert_allclose((ahead - behind) / (2 * step), gradient, atol=1e-5)

"""Elimination of constraints against a dense solve of the saddle point system."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.solvers.constrained_elimination import ConstrainedElimination

SIZE = 12


def drawn(constraints: int, shape: tuple[int, ...]):
    """A positive definite K, rows C, a right-hand side r and values g."""
    random = np.random.default_rng(constraints)
    root = random.standard_normal((SIZE, SIZE))
    stiffness = root @ root.T + np.eye(SIZE)
    rows = random.standard_normal((constraints, *shape))
    return stiffness, rows, random.standard_normal(shape), random.standard_normal(constraints)


def dense(stiffness, rows, right, values, compliance):
    """x and f by the whole matrix [K, -Cᵀ; C, S]."""
    flat, count = rows.reshape(len(rows), SIZE), len(rows)
    whole = np.block([[stiffness, -flat.T], [flat, compliance * np.eye(count)]])
    found = np.linalg.solve(whole, np.concatenate([right.ravel(), values]))
    return found[:SIZE].reshape(right.shape), found[SIZE:]


@pytest.mark.parametrize("shape", [(SIZE,), (SIZE // 2, 2)], ids=["vector", "nodal"])
@pytest.mark.parametrize(
    "compliance", [0.0, 0.3, np.array([0.0, 2.0, 0.1])], ids=["rigid", "springs", "both"]
)
def test_it_is_the_solution_of_the_saddle_point_system(shape, compliance):
    stiffness, rows, right, values = drawn(3, shape)
    inverse = np.linalg.inv(stiffness)

    def solve(force):
        return (inverse @ force.ravel()).reshape(shape)

    elimination = ConstrainedElimination(rows, np.array([solve(row) for row in rows]), compliance)
    found, forces = elimination.solution(solve(right), values)
    expected, multipliers = dense(stiffness, rows, right, values, compliance)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(forces, multipliers, rtol=0, atol=1e-12)
    np.testing.assert_allclose(elimination.values(found) + compliance * forces, values, atol=1e-12)


def test_values_of_zero_by_default():
    stiffness, rows, right, _ = drawn(2, (SIZE,))
    inverse = np.linalg.inv(stiffness)
    elimination = ConstrainedElimination(rows, rows @ inverse)
    found, _ = elimination.solution(inverse @ right)
    np.testing.assert_allclose(rows @ found, 0, atol=1e-12)
    soft, _ = replace(elimination, compliance=1e12).solution(inverse @ right)
    np.testing.assert_allclose(soft, inverse @ right, rtol=1e-9)


def test_without_constraints_the_solution_is_free():
    elimination = ConstrainedElimination(np.zeros((0, 4, 2)), np.zeros((0, 4, 2)))
    free = np.arange(8.0).reshape(4, 2)
    found, forces = elimination.solution(free)
    np.testing.assert_array_equal(found, free)
    assert forces.shape == (0,)

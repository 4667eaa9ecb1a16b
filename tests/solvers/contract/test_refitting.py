"""Solving again for other observations, with work shared, is solving again."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Load, Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solver import Refittable, refitter
from tests.solvers.conftest import observed_at

QUICK = {"wall_spacing": 1.2, "corner_spacing": 0.3, "neurons": 3, "tolerance": 0.05}
PRECISE = {"preset": "local", "weights": "precision"}
SOLVERS: dict[str, dict[str, object]] = {
    "gp": {},
    "pinn-asm": QUICK,
    "pinn-asm, weights chosen": QUICK | PRECISE | {"choose": "left-out"},
    "pinn-asm, a soft contact": QUICK | PRECISE | {"contact_deviation": 1.0},
}


@pytest.fixture(scope="module")
def observed(coarse_mesh: TriangleMesh) -> list[Observations]:
    """Of markers of a finger that is pressed otherwise: seven with noise; six others."""
    other = Problem(coarse_mesh, load=Load(displacement=(-1.0, -9.0)))
    points = coarse_mesh.markers
    true = FemSolver(degree=1, estimate=False).solve(other).displacement(points)
    noise = np.random.default_rng(1).normal(0, 0.05, true.shape)
    every = observed_at(points, true, 0.05)
    return [
        replace(every, displacements=true + noise, visible=~np.isin(np.arange(9), (2, 5))),
        replace(every, visible=~np.isin(np.arange(9), (6, 7, 8))),
    ]


@pytest.mark.slow
@pytest.mark.parametrize("name", SOLVERS)
def test_a_refit_is_a_solution(coarse_mesh, observed, name):
    solver = make_solver(name.split(",")[0], **SOLVERS[name])
    assert isinstance(solver, Refittable)
    problem = Problem(coarse_mesh)
    refit = refitter(solver, problem)
    inside = body_quadrature(coarse_mesh).location
    for observations in observed:
        expected = solver.solve(replace(problem, observations=observations))
        found = refit(observations)
        np.testing.assert_allclose(found.displacement(inside), expected.displacement(inside), atol=1e-6)
        np.testing.assert_allclose(found.gradient(inside), expected.gradient(inside), atol=1e-5)
        assert found.energy == pytest.approx(expected.energy, rel=1e-5)
        np.testing.assert_allclose(found.reaction, expected.reaction, rtol=1e-5, atol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pinn-asm"])
@pytest.mark.parametrize("change", ["points", "marker_radius"])
def test_other_markers_are_solved_afresh(coarse_mesh, observed, name, change):
    solver = make_solver(name, **SOLVERS[name])
    refit = refitter(solver, Problem(coarse_mesh))
    first = replace(observed[0], marker_radius=0.3)
    refit(first)
    changes = {"points": first.points + np.array([0.5, 0.1]), "marker_radius": 0.2}
    other = replace(first, **{change: changes[change]})
    expected = solver.solve(Problem(coarse_mesh, observations=other))
    np.testing.assert_allclose(refit(other).displacement(other.points), expected.displacement(other.points))


def test_another_solver_is_just_asked_again(coarse_mesh, observed):
    class Plain:
        name = "plain"

        def solve(self, problem, progress):
            return FemSolver(degree=1, estimate=False).solve(problem, progress)

    found = refitter(Plain(), Problem(coarse_mesh))(observed[1])
    assert found.problem.observations is observed[1]

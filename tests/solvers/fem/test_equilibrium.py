"""The discrete finite-strain problem: derivatives by Taylor's theorem, objectivity, SNES and its failures."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.solvers.fem.equilibrium import DiscreteEquilibrium, LoadState
from pinnray.solvers.fem.finite_strain.newton import ConstrainedNewton, NewtonResult
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.problem import Load, Material, Problem
from tests.solvers.conftest import bar_mesh

LAWS = ("neo-hookean", "st-venant-kirchhoff")
STEPS = 0.1 * 0.5 ** np.arange(4)


def equilibrium(law, load=Load(kind="patch")) -> DiscreteEquilibrium:
    mesh = bar_mesh(8.0, 2.0, 8, 2, contact=(3.0, 5.0))
    return DiscreteEquilibrium(Problem(mesh, Material(law=law, poisson=0.3), load), LagrangeSpace(mesh, 2))


def fields(problem: DiscreteEquilibrium, *seeds: int, size: float = 0.02) -> list[np.ndarray]:
    """Random displacements that are zero where clamped, smooth enough to turn no element inside out."""
    return [
        np.where(problem.clamped, 0.0, np.random.default_rng(seed).normal(size=problem.clamped.shape)) * size
        for seed in seeds
    ]


def times_tangent(problem: DiscreteEquilibrium, direction: np.ndarray) -> np.ndarray:
    vector, product = problem.matrix.createVecs()
    vector.array[:] = problem.elements.dofs(direction)
    problem.matrix.mult(vector, product)
    return problem.elements.nodal(product.array_r)


def slopes(remainders) -> np.ndarray:
    remainders = np.abs(remainders)
    return np.log2(remainders[:-1] / remainders[1:])


@pytest.mark.parametrize("law", LAWS)
def test_energy_has_the_internal_force_and_the_tangent_as_derivatives(law):
    """Taylor: what is left without the second derivative falls with t^2, with it with t^3."""
    problem = equilibrium(law)
    start, direction = fields(problem, 0, 1)
    energy, force = problem.energy(start), problem.internal_force(start)
    problem.factorise(replace(problem.rest, nodal=start))
    first, second = (force * direction).sum(), (direction * times_tangent(problem, direction)).sum()
    changes = np.array([problem.energy(start + t * direction) - energy for t in STEPS])
    np.testing.assert_allclose(slopes(changes - STEPS * first), 2, atol=0.1)
    np.testing.assert_allclose(slopes(changes - STEPS * first - 0.5 * STEPS**2 * second), 3, atol=0.1)


def test_balance_with_a_cylinder_has_its_tangent_as_derivative():
    """With some nodes in contact and the cylinder shifted, so that its normals turn."""
    load = Load(kind="cylinder", radius=3.0, displacement=(0.1, -0.2))
    problem = equilibrium("neo-hookean", load)
    nodal, direction = fields(problem, 0, 1, size=0.01)
    start = LoadState(1.0, nodal, np.full(len(problem.contact.nodes), 0.05), np.zeros(0))
    pressed = problem.contact.forces(start) > 0
    assert 0 < pressed.sum() < len(pressed)
    balance, _ = problem.residual(start)
    problem.factorise(start)
    change = times_tangent(problem, direction)
    steps = 0.1 * STEPS  # so small that no node comes into contact or leaves it
    there = [problem.residual(replace(start, nodal=nodal + t * direction))[0] for t in steps]
    left = [np.linalg.norm(force - balance - t * change) for force, t in zip(there, steps, strict=True)]
    np.testing.assert_allclose(slopes(left), 2, atol=0.1)


def newton(problem: DiscreteEquilibrium, iterations: int = 12) -> ConstrainedNewton:
    return ConstrainedNewton(problem, 1e-8, iterations)


def started(problem: DiscreteEquilibrium, iterations: int = 12) -> NewtonResult:
    """From the linear guess to the full load."""
    return newton(problem, iterations).solve(problem.linear_guess(1.0))


def test_newton_meets_constraints_and_balance_and_converges_quadratically():
    problem = equilibrium("neo-hookean", Load(kind="mean", displacement=(0.1, -0.4)))
    balance = started(problem)
    assert (balance.converged, balance.reason) == (True, "converged_fnorm_relative")
    assert balance.iterations <= 5
    left, size = problem.residual(balance.state)
    assert np.abs(left).max() < 1e-8 * size
    missing = problem.constraints.residual(balance.state.nodal, balance.state.forces, 1.0)
    np.testing.assert_allclose(missing, 0, atol=1e-10)
    assert balance.tangent, "that of equilibrium"
    assert not newton(problem).solve(balance.state).tangent, "none was formed"


def test_newton_says_why_it_fails():
    problem = equilibrium("neo-hookean", Load(kind="mean", displacement=(0.1, -0.4)))
    far = started(problem, 1)
    assert (far.converged, far.reason, far.tangent) == (False, "diverged_max_it", False)
    (inside_out,) = fields(problem, 0, size=2.0)
    torn = newton(problem).solve(replace(problem.rest, fraction=1.0, nodal=inside_out))
    assert (torn.converged, torn.reason) == (False, "diverged_function_domain")


def test_newton_meets_constraints_that_its_start_misses():
    problem = equilibrium("neo-hookean", Load(kind="mean", displacement=(0.02, -0.05)))
    expected = started(problem)
    found = newton(problem).solve(replace(problem.rest, fraction=1.0))
    assert found.converged
    np.testing.assert_allclose(found.state.nodal, expected.state.nodal, atol=1e-8)
    np.testing.assert_allclose(found.state.forces, expected.state.forces, rtol=1e-6)


def test_a_guess_off_the_cylinder_is_first_held_there():
    """Set free at once, the bar would spring back, and Newton's method would need many short steps."""
    problem = equilibrium("neo-hookean", Load(kind="cylinder", radius=3.0, displacement=(0.0, -0.6)))
    solver, contact = newton(problem), problem.contact
    pressed = solver.solve(replace(problem.linear_guess(0.2), fraction=0.2)).state
    pressed, _ = contact.settled(pressed)
    off = replace(pressed, nodal=1.3 * pressed.nodal)
    assert not contact.forces(off).any()
    assert contact.forces(contact.holding(off)).min() < 0
    found = solver.solve(off)
    assert found.converged
    assert found.iterations <= 4
    assert not found.state.held
    assert contact.forces(found.state).min() == 0
    again = solver.solve(replace(pressed, nodal=1.001 * pressed.nodal))
    np.testing.assert_allclose(found.state.nodal, again.state.nodal, atol=1e-7)


@pytest.mark.parametrize("law", ["linear", "neo-hookean"])
def test_unknowns_are_eliminated_in_the_order_of_least_fill(law):
    """Its analysis takes a third of the time of MUMPS' own choice for a mesh of this size."""
    mesh = bar_mesh(8.0, 2.0, 128, 32, contact=(3.0, 5.0))
    problem = DiscreteEquilibrium(Problem(mesh, Material(law=law, poisson=0.3)), LagrangeSpace(mesh, 2))
    ordering, approximate_minimum_fill = 7, 2  # in MUMPS' guide
    assert problem.factors._ready().output(ordering) == approximate_minimum_fill

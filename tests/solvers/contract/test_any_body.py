"""Every solver on bodies of all kinds: curved, tilted and divided bases, curved fronts, notches."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import trapezoid

from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.solvers.energy_and_force import energy_and_force, harmonic_slope, section_slope
from pinnray.solvers.problem import Load, Material, Problem, contact_functional
from pinnray.solvers.registry import make_solver, usable_solvers
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import Traits, with_law
from tests.solvers.bodies import BODIES, body_mesh, mesh_of, ring
from tests.solvers.conftest import distances, observed_at
from tests.solvers.contract.test_contract import QUICK

COARSE, FINE = 1.0, 0.6
"""Element sizes, mm."""

TINY = {"preset": "trained", "wall_spacing": 2.0, "corner_spacing": 0.3, "neurons": 3, "steps": 1}

SETTINGS = QUICK | {
    "pinn-std paper": {"preset": "paper", "epochs": 2, "width": 8, "layers": 1, "base_points": 20},
    "pinn-asm paper": {"preset": "paper", "epochs": 2, "width": 8, "layers": 1, "base_points": 20},
    "pinn-std trained": TINY,
    "pinn-asm trained": TINY,
    "fem-id": {"law": "given"},
    "pinn-id": {"spacing": 3.0, "law": "given"},
}

SOLVERS = [
    *usable_solvers(),
    *(f"{name} {preset}" for preset in ("local", "paper", "trained") for name in ("pinn-std", "pinn-asm")),
]

AGREES = {
    **{"fem": 1e-9, "fem-nonlinear": 0.03, "fem-id": 0.01, "fem-asm": 0.01},
    **dict.fromkeys(("pinn-std", "pinn-std local", "pinn-std trained"), 0.05),
    **dict.fromkeys(("pinn-asm", "pinn-asm local", "pinn-asm trained", "pinn-id"), 0.05),
}
"""Relative difference in L2 from `fem` at a travel of 0.2 mm, the markers being those of `fem`: rounding; the
change of shape; means over the markers' discs; networks that are made coarse here."""

CASES = [
    pytest.param(solver, body, marks=[pytest.mark.slow] * solver.startswith(("pinn", "fem-3d", "fem-id")))
    for solver in SOLVERS
    for body in ("ring", "feet and slot")
]
"""On a curved base and on a divided one; networks are compared on four more on the finer mesh."""

NETWORKS = {**dict.fromkeys(("tilted wedge", "arch"), "fast"), **dict.fromkeys(("beam", "notched"), "local")}
"""Preset by body."""


def problem_of(name: str, size: float, travel: float = 0.2) -> Problem:
    return Problem(body_mesh(name, size), load=Load(displacement=(0.0, -travel)))


@cache
def by_fem(name: str, size: float) -> Solution:
    return make_solver("fem").solve(problem_of(name, size))


@pytest.mark.parametrize(("solver", "body"), CASES)
def test_every_solver_takes_every_body(solver, body):
    made = make_solver(solver.split()[0], **SETTINGS.get(solver, {}))
    reference = by_fem(body, COARSE)
    mesh, assimilates = reference.problem.mesh, Traits.of(made).assimilates
    seen = observed_at(mesh.markers, reference.displacement(mesh.markers), 0.01) if assimilates else None
    problem = replace(reference.problem, material=with_law(Material(), made), observations=seen)
    solution = made.solve(problem)
    assert np.isfinite(solution.energy)
    assert np.isfinite(solution.state(mesh.at_nodes().points).von_mises).all(), "at the base's ends too"
    if solver not in AGREES:
        return
    assert distances(solution, reference)[0] < AGREES[solver]
    if solver not in ("fem-id", "pinn-id"):  # clamps that give
        assert_clamped(solution)
    if not assimilates:
        assert_loaded(solution)


def assert_clamped(solution: Solution) -> None:
    mesh = solution.problem.mesh
    base = mesh.points[np.unique(mesh.boundary("base"))]
    assert np.abs(solution.displacement(base)).max() < 1e-12


def assert_loaded(solution: Solution) -> None:
    points, weights = contact_functional(solution.problem)
    np.testing.assert_allclose(weights @ solution.displacement(points), [0.0, -0.2], atol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("body", "preset"), NETWORKS.items())
def test_a_network_is_within_one_percent_of_finite_elements_on_any_body(body, preset):
    solution = make_solver("pinn-std", preset=preset).solve(problem_of(body, FINE))
    assert solution.status.converged
    assert distances(solution, by_fem(body, FINE))[0] < 0.01
    assert_clamped(solution)
    assert_loaded(solution)


def test_a_thin_ring_gives_way_as_a_curved_beam():
    """A quarter of a millimetre of travel at the top of a ring of 1 mm, clamped on an arc at its bottom.

    Half of it is a curved beam from the top, which does not turn, to the clamp. With the moment M0, the
    thrust H and half the load P / 2 at the top, M = M0 + H R (1 - cos θ) - P / 2 R sin θ; bending, stretching
    and shear add up, and M0 and H do no work (Castigliano's theorem).
    """
    radius, thickness, travel = 20.0, 1.0, 0.25
    section, middle = ring(radius, thickness, 90.0)
    mesh = mesh_of(section, middle, 0.25, 1.0)
    solution = make_solver("fem").solve(Problem(mesh, load=Load(displacement=(None, -travel))))
    material, mean, end = Material(), radius - thickness / 2, np.pi - np.pi / 4
    modulus = material.young / (1 - material.poisson**2)
    bending, stretching = modulus * thickness**3 / 12, modulus * thickness
    shear = 5 / 6 * material.young / (2 * (1 + material.poisson)) * thickness
    angle = np.linspace(0, end, 20001)
    one, sine, cosine = np.ones_like(angle), np.sin(angle), np.cos(angle)
    # moment, thrust and shear for M0 = 1, H = 1 and P / 2 = 1
    moments = np.array([one, mean * (1 - cosine), -mean * sine])
    thrusts = np.array([0 * one, cosine, sine])
    shears = np.array([0 * one, sine, -cosine])
    flexibility = sum(
        trapezoid(forces[:, None] * forces[None], angle) * mean / stiffness
        for forces, stiffness in ((moments, bending), (thrusts, stretching), (shears, shear))
    )
    unknown = np.linalg.solve(flexibility[:2, :2], -flexibility[:2, 2])
    force = 2 * travel / (flexibility[2, 2] + flexibility[2, :2] @ unknown)
    assert -solution.reaction[1] == pytest.approx(force, rel=0.03), "thickness over radius is 0.05"


@pytest.mark.parametrize("body", BODIES)
def test_the_force_of_sections_is_that_of_the_elements(body):
    """Exactly by the harmonic function, which is one of the elements' own; nearly so by x."""
    solution = by_fem(body, COARSE)
    energy, force = energy_and_force(solution.problem, solution.field)
    assert energy == pytest.approx(solution.energy, rel=1e-9)
    size = np.linalg.norm(solution.reaction)
    np.testing.assert_allclose(force, solution.reaction, atol=0.01 * size)
    rule = body_quadrature(solution.problem.mesh, 2)
    slope = harmonic_slope(solution.problem, rule.location)
    stress = solution.state(rule.location).stress
    found = np.einsum("q,qij,qj->i", rule.weights, stress, slope)
    np.testing.assert_allclose(found, solution.reaction, atol=1e-9 * size)


def test_sections_by_x_are_taken_where_they_separate_base_and_contact():
    for body, linear in {"beam": True, "feet and slot": True, "ring": False, "arch": False}.items():
        problem = problem_of(body, COARSE)
        slope = section_slope(problem, problem.mesh.at_centroids())
        assert (np.abs(slope[:, 1]).max() == 0) == linear, body


@pytest.mark.slow
@pytest.mark.parametrize("body", ["ring", "arch"])
def test_a_rigid_patch_moves_a_curved_front_as_a_whole(body):
    problem = Problem(body_mesh(body, COARSE), load=Load(kind="patch", displacement=(0.0, -0.2)))
    contact = problem.mesh.points[np.unique(problem.mesh.boundary("contact"))]
    for name in ("fem", "pinn-std"):
        moved = make_solver(name, **SETTINGS.get(name, {})).solve(problem).displacement(contact)
        assert np.abs(moved - [0.0, -0.2]).max() < 0.002, name


@pytest.mark.slow
def test_a_cylinder_starts_where_it_touches_a_curved_front_from_outside():
    """At R + r from the centre of a ring of radius R, on its top and beside it."""
    from pinnray.solvers.contact.nodal_contact import CylinderContact
    from pinnray.solvers.lagrange import LagrangeSpace

    mesh = body_mesh("ring", 0.4)
    load = Load(kind="cylinder", radius=5.0, displacement=(0.0, -0.5))
    top = Problem(mesh, Material(law="neo-hookean"), load)
    contact = CylinderContact.of(top, LagrangeSpace(mesh, 2))
    assert contact.centre == pytest.approx([0.0, 5.0], abs=1e-3)
    side = Problem(mesh, Material(law="neo-hookean"), load.model_copy(update={"position": 8.0}))
    x, y = CylinderContact.of(side, LagrangeSpace(mesh, 2)).centre
    # Between two nodes 0.4 mm apart the circles come closer by 0.4^2 / 8 (1 / 20 + 1 / 5) mm.
    assert np.hypot(x, y + 20.0) == pytest.approx(25.0, abs=5e-3)
    solution = make_solver("fem-nonlinear").solve(top)
    assert solution.status.converged
    assert solution.reaction[1] < 0


@pytest.mark.parametrize("body", BODIES)
def test_the_certificate_of_finite_elements_has_no_fault_on_any_body(body):
    from pinnray.comparison.evaluation.certifier import Certifier
    from pinnray.comparison.evaluation.evaluation import Evaluation

    solution = by_fem(body, COARSE)
    found = Certifier(solution.problem).certificate(Evaluation.of(solution, solution.problem.mesh))
    assert not found.faults
    assert found.weak_residual < 1e-9

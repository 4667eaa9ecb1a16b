"""The rigid cylinder: what contact must obey (`tests/verification` has Hertz, Cattaneo and Mindlin)."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid

from pinnray.solvers.contact.nodal_contact import ContactState, CylinderContact
from pinnray.solvers.extrusion import ExtrudedSpace
from pinnray.solvers.fem.equilibrium import DiscreteEquilibrium
from pinnray.solvers.fem.finite_strain.load_path import PENETRATION
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.fem.solid import Fem3dSolver
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.problem import Load, Material, Problem, contact_ends
from tests.solvers.conftest import bar_mesh


@pytest.fixture(scope="module")
def pressed(coarse_mesh):
    """The default finger with a cylinder pressed in by 10 mm."""
    return FemNonlinearSolver().solve(
        Problem(coarse_mesh, Material(law="neo-hookean"), Load(kind="cylinder", radius=5.0))
    )


def at_the_front(solution):
    """Forces on the nodes of the front by the elements' own balance, and their places from the axis."""
    space = solution.field.space
    nodes = space.boundary_nodes("front")
    nodes = nodes[space.nodes[nodes, 0] > 0]  # the clamp has forces of its own
    forces = DiscreteEquilibrium(solution.problem, space).internal_force(solution.field.values)[nodes]
    middle = np.mean(contact_ends(solution.problem))
    return forces, space.nodes[nodes] + solution.field.values[nodes] - [middle, 5.0 - 10.0]


def test_cylinder_presses_without_friction_and_only_where_it_touches(pressed):
    """Forces along the normal, into the finger, after all of the way."""
    assert pressed.status.converged
    assert pressed.history["load_fraction"][-1] == 1
    assert pressed.contact.points.slips.all()
    assert not pressed.contact.points.friction.any()
    forces, away = at_the_front(pressed)
    gap = np.linalg.norm(away, axis=1) - 5.0
    normal = away / np.linalg.norm(away, axis=1)[:, None]
    pressure = (forces * normal).sum(axis=1)
    size = np.abs(forces).max()
    assert gap.min() > -PENETRATION
    assert pressure.min() > -1e-6 * size
    assert np.abs(forces - pressure[:, None] * normal).max() < 1e-6 * size
    touching = pressure > 1e-6 * size
    assert 0 < touching.sum() < 20
    assert np.abs(gap[touching]).max() < PENETRATION
    np.testing.assert_allclose(forces.sum(axis=0), pressed.reaction, rtol=1e-6)


def test_a_cylinder_that_moves_away_does_not_touch(coarse_mesh):
    load = Load(kind="cylinder", radius=5.0, displacement=(0.0, 0.5))
    solution = FemNonlinearSolver(first_step=1.0, max_step=1.0).solve(
        Problem(coarse_mesh, Material(law="neo-hookean"), load)
    )
    assert solution.status.converged
    assert solution.energy == pytest.approx(0, abs=1e-12)


def test_contact_that_leaves_the_front_face_is_not_converged():
    bar = bar_mesh(8.0, 2.0, 8, 2, contact=(6.0, 8.0))
    load = Load(kind="cylinder", radius=5.0, displacement=(1.0, -0.3))
    solution = FemNonlinearSolver(degree=1).solve(
        Problem(bar, Material(poisson=0.3, law="neo-hookean"), load)
    )
    assert not solution.status.converged


@pytest.fixture(scope="module")
def rough(coarse_mesh):
    """The same with a friction of 0.5."""
    load = Load(kind="cylinder", radius=5.0, friction=0.5)
    return FemNonlinearSolver().solve(Problem(coarse_mesh, Material(law="neo-hookean"), load))


@pytest.mark.slow
def test_friction_takes_the_finger_along(pressed, rough):
    """The finger bends and slides toward its base: friction holds it back, and the work done is more."""
    assert rough.status.converged
    points = rough.contact.points
    assert points.pressure.min() > 0
    assert (np.abs(points.friction) <= 0.5 * points.pressure * (1 + 1e-6)).all()
    slipping = points.slips
    np.testing.assert_allclose(np.abs(points.friction[slipping]), 0.5 * points.pressure[slipping], rtol=1e-3)
    assert rough.stats["contact_friction_N_per_mm"] > 0
    assert rough.reaction[0] - pressed.reaction[0] > 0.05
    work = trapezoid(rough.history["reaction_y"], -10.0 * rough.history["load_fraction"])
    assert rough.energy < work


def test_the_indenters_force_is_pressure_and_friction(rough):
    forces, away = at_the_front(rough)
    np.testing.assert_allclose(forces.sum(axis=0), rough.reaction, rtol=1e-6)
    normal = away / np.linalg.norm(away, axis=1)[:, None]
    along = forces @ np.array([[0.0, -1.0], [1.0, 0.0]]).T
    rubbed = (along * normal).sum(axis=1).sum()
    # The contact is settled to 1e-5 mm, in which its stiffness of 114 N/mm2 makes 1e-3 N/mm a node.
    assert abs(rubbed) == pytest.approx(rough.stats["contact_friction_N_per_mm"], abs=1e-3)


@pytest.fixture(scope="module")
def rubbed_bar():
    """A bar under a cylinder that rubs: friction makes seven eighths of its force along x."""
    bar = bar_mesh(8.0, 2.0, 12, 3, contact=(3.0, 5.0))
    load = Load(kind="cylinder", radius=5.0, displacement=(0.0, -0.3), friction=0.5)
    return FemNonlinearSolver().solve(Problem(bar, Material(poisson=0.3, law="neo-hookean"), load))


def test_finer_steps_change_the_friction_little(rubbed_bar):
    fine = FemNonlinearSolver(first_step=0.05, max_step=0.05).solve(rubbed_bar.problem)
    np.testing.assert_allclose(fine.reaction, rubbed_bar.reaction, rtol=0.01)


def touched(mesh, space, fraction):
    """A cylinder that rubs on a finger at rest, under a share of the load and with forces of 0.3 N/mm."""
    load = Load(kind="cylinder", radius=5.0, friction=0.5)
    contact = CylinderContact.of(Problem(mesh, Material(law="neo-hookean"), load), space)
    return contact, ContactState(fraction, np.zeros(space.nodes.shape), np.full(len(contact.nodes), 0.3))


@pytest.mark.parametrize("solid", [False, True])
def test_the_tangent_of_friction_is_the_derivative_of_its_gradient(coarse_mesh, solid):
    """Some nodes stick, some slip, and all are a little off their places."""
    space = ExtrudedSpace.of(coarse_mesh, 1, 1.0) if solid else LagrangeSpace(coarse_mesh, 2)
    contact, rest = touched(coarse_mesh, space, 0.1)
    rng = np.random.default_rng(1)
    nodal, started = 0.01 * rng.standard_normal(space.nodes.shape), contact.started(rest)
    friction = replace(started, bounds=0.1 * rng.random(len(contact.nodes)))
    state = replace(rest, nodal=nodal, friction=friction)
    assert 0 < contact.slips(state)[2].sum() < len(contact.nodes)
    tangent = contact.tangent(state)
    size, step = tangent.shape[-1], 1e-8  # no node begins to slip within it
    assert size == (3 if solid else 2)
    for axis in range(size):
        moved = np.zeros(space.nodes.shape)
        moved[contact.nodes, axis] = step
        ahead, behind = (contact.gradient(replace(state, nodal=nodal + sign * moved)) for sign in (1, -1))
        np.testing.assert_allclose((ahead - behind) / (2 * step), tangent[:, :, axis], atol=1e-4)


def test_slip_counts_from_the_last_equilibrium(coarse_mesh):
    """A step that begins at an equilibrium has its bounds and no friction, however far that one slipped."""
    contact, rest = touched(coarse_mesh, LagrangeSpace(coarse_mesh, 2), 0.0)
    bounds = np.linspace(0.0, 0.1, len(contact.nodes))
    slipped = replace(
        rest, nodal=np.add(rest.nodal, [5.0, 0.0]), friction=replace(contact.started(rest), bounds=bounds)
    )
    np.testing.assert_allclose(np.abs(contact.frictions(slipped)[:, 0]), bounds)
    begun = replace(slipped, friction=contact.started(slipped))
    np.testing.assert_array_equal(contact.frictions(begun), 0)
    np.testing.assert_array_equal(begun.friction.bounds, bounds)


def test_solid_in_plane_strain_rubs_as_the_plane_does(rubbed_bar):
    solid = Fem3dSolver(layers=1, sides="held").solve(rubbed_bar.problem)
    assert solid.status.converged
    np.testing.assert_allclose(solid.reaction, rubbed_bar.reaction, rtol=0.005)

"""The rigid cylinder: what contact must obey (`tests/verification` has Hertz, Cattaneo and Mindlin)."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid

from geometry.errors import UserError
from solvers.cylinder_contact import ContactState, CylinderContact
from solvers.extrusion import ExtrudedSpace
from solvers.fem.equilibrium import DiscreteEquilibrium
from solvers.fem.finite_strain.load_path import PENETRATION
from solvers.fem.finite_strain.solver import FemNonlinearSolver
from solvers.fem.linear import FemSolver
from solvers.fem.solid import Fem3dSolver
from solvers.lagrange import LagrangeSpace
from solvers.problem import Load, Material, Problem, contact_ends
from solvers.registry import make_solver
from tests.solvers.conftest import bar_mesh


@pytest.fixture(scope="module")
def pressed(coarse_mesh):
    """The default finger with a cylinder pressed in by 10 mm."""
    return FemNonlinearSolver().solve(
        Problem(coarse_mesh, Material(law="neo-hookean"), Load(kind="cylinder", radius=5.0))
    )


def test_cylinder_is_pressed_all_the_way_in(pressed):
    assert pressed.status.converged
    assert "contact from x = 3" in pressed.status.message
    assert pressed.history["load_fraction"][-1] == 1
    assert pressed.history["contact_width_mm"][-1] == pressed.stats["contact_width_mm"]


def test_cylinder_presses_without_friction_and_only_where_it_touches(pressed):
    """Forces on the nodes of the front, by the elements' own balance: along the normal, into the finger."""
    space = pressed.field.space
    nodes = space.boundary_nodes("front")
    nodes = nodes[space.nodes[nodes, 0] > 0]  # the clamp has forces of its own
    forces = DiscreteEquilibrium(pressed.problem, space).internal_force(pressed.field.values)[nodes]
    middle = np.mean(contact_ends(pressed.problem))
    away = space.nodes[nodes] + pressed.field.values[nodes] - [middle, 5.0 - 10.0]
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


def test_work_of_the_cylinder_is_the_stored_energy(pressed):
    """The trapezium rule over the seven load steps."""
    done = trapezoid(pressed.history["reaction_y"], -10.0 * pressed.history["load_fraction"])
    assert done == pytest.approx(pressed.energy, rel=0.01)


def test_a_cylinder_that_moves_away_does_not_touch(coarse_mesh):
    load = Load(kind="cylinder", radius=5.0, displacement=(0.0, 0.5))
    solution = FemNonlinearSolver(first_step=1.0, max_step=1.0).solve(
        Problem(coarse_mesh, Material(law="neo-hookean"), load)
    )
    assert solution.status.converged
    assert "does not touch the finger" in solution.status.message
    assert solution.energy == pytest.approx(0, abs=1e-12)


def test_contact_that_leaves_the_front_face_is_not_converged():
    bar = bar_mesh(8.0, 2.0, 8, 2, contact=(6.0, 8.0))
    load = Load(kind="cylinder", radius=5.0, displacement=(1.0, -0.3))
    solution = FemNonlinearSolver(degree=1).solve(
        Problem(bar, Material(poisson=0.3, law="neo-hookean"), load)
    )
    assert not solution.status.converged
    assert "the contact reaches an end of the front face" in solution.status.message


def test_linear_solvers_refuse_a_cylinder(coarse_mesh):
    with pytest.raises(UserError, match="fem takes the loads mean, point, patch, not 'cylinder'"):
        FemSolver().solve(Problem(coarse_mesh, load=Load(kind="cylinder", radius=5.0)))


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"kind": "mean", "radius": 5.0}, "a radius belongs to the load cylinder"),
        ({"kind": "cylinder", "radius": -1.0}, "greater than 0"),
        ({"kind": "cylinder", "radius": 5.0, "displacement": (None, -1.0)}, "as friction lets it"),
        ({"kind": "cylinder", "radius": 5.0, "displacement": (0.0, 0.0)}, "does not move"),
        ({"kind": "mean", "friction": 0.5}, "friction belongs to the load cylinder"),
        ({"kind": "cylinder", "radius": 5.0, "friction": 50.0}, "friction = 50 is outside its range, 0 to 5"),
    ],
)
def test_a_cylinder_that_makes_no_sense_is_refused(values, said):
    with pytest.raises(ValueError, match=said):
        Load(**values)
    assert Load(kind="cylinder").radius == 5.0


def test_without_friction_nothing_rubs(pressed):
    assert pressed.contact.points.slips.all()
    assert not pressed.contact.points.friction.any()
    assert "contact_friction_N_per_mm" not in pressed.stats


@pytest.fixture(scope="module")
def rough(coarse_mesh):
    """The same with a friction of 0.5."""
    load = Load(kind="cylinder", radius=5.0, friction=0.5)
    return FemNonlinearSolver().solve(Problem(coarse_mesh, Material(law="neo-hookean"), load))


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
    """By the elements' own balance at the nodes of the front."""
    space = rough.field.space
    nodes = space.boundary_nodes("front")
    nodes = nodes[space.nodes[nodes, 0] > 0]
    forces = DiscreteEquilibrium(rough.problem, space).internal_force(rough.field.values)[nodes]
    np.testing.assert_allclose(forces.sum(axis=0), rough.reaction, rtol=1e-6)
    middle = np.mean(contact_ends(rough.problem))
    away = space.nodes[nodes] + rough.field.values[nodes] - [middle, 5.0 - 10.0]
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


@pytest.mark.parametrize("solid", [False, True])
def test_the_tangent_of_friction_is_the_derivative_of_its_gradient(coarse_mesh, solid):
    """Some nodes stick, some slip, and all are a little off their places."""
    problem = Problem(
        coarse_mesh, Material(law="neo-hookean"), Load(kind="cylinder", radius=5.0, friction=0.5)
    )
    space = ExtrudedSpace.of(coarse_mesh, 1, 1.0) if solid else LagrangeSpace(coarse_mesh, 2)
    contact = CylinderContact.of(problem, space)
    rng = np.random.default_rng(1)
    rest = ContactState(0.1, np.zeros(space.nodes.shape), np.full(len(contact.nodes), 0.3))
    started = contact.started(rest)
    assert started is not None
    state = replace(
        rest,
        nodal=0.001 * rng.standard_normal(space.nodes.shape),
        friction=replace(
            started,
            forces=0.1 * rng.standard_normal(started.forces.shape),
            sticks=rng.random(len(contact.nodes)) < 0.5,
        ),
    )
    tangent = contact.tangent(state)
    size, step = tangent.shape[-1], 1e-6
    assert size == (3 if solid else 2)
    for axis in range(size):
        moved = np.zeros(space.nodes.shape)
        moved[contact.nodes, axis] = step
        slopes = (
            contact.gradient(replace(state, nodal=state.nodal + moved))
            - contact.gradient(replace(state, nodal=state.nodal - moved))
        ) / (2 * step)
        np.testing.assert_allclose(slopes, tangent[:, :, axis], atol=1e-4)


def test_slip_counts_from_the_last_equilibrium(coarse_mesh):
    """A step that begins at an equilibrium has its frictions, however far that one slipped."""
    problem = Problem(
        coarse_mesh, Material(law="neo-hookean"), Load(kind="cylinder", radius=5.0, friction=0.5)
    )
    space = LagrangeSpace(coarse_mesh, 2)
    contact = CylinderContact.of(problem, space)
    rest = ContactState(0.0, np.zeros(space.nodes.shape), np.full(len(contact.nodes), 0.3))
    first = contact.started(rest)
    forces = np.linspace(-0.1, 0.1, len(contact.nodes))[:, None]
    stuck = replace(first, forces=forces, sticks=np.ones(len(contact.nodes), dtype=bool))
    slipped = replace(rest, nodal=np.add(rest.nodal, [0.5, 0.0]), friction=stuck)
    assert np.abs(contact.frictions(slipped) - forces).max() > 1
    begun = replace(slipped, friction=contact.started(slipped))
    np.testing.assert_allclose(contact.frictions(begun), forces, atol=1e-12)


def test_solid_in_plane_strain_rubs_as_the_plane_does(rubbed_bar):
    solid = Fem3dSolver(layers=1, sides="held").solve(rubbed_bar.problem)
    assert solid.status.converged
    np.testing.assert_allclose(solid.reaction, rubbed_bar.reaction, rtol=0.005)


def test_a_network_refuses_friction(coarse_mesh):
    load = Load(kind="cylinder", radius=5.0, friction=0.5)
    with pytest.raises(UserError, match="pinn-std takes a cylinder without friction; leave friction out"):
        make_solver("pinn-std").solve(Problem(coarse_mesh, Material(law="neo-hookean"), load))

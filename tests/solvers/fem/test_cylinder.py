"""The rigid cylinder: what contact without friction must obey (`tests/verification` has Hertz)."""

import numpy as np
import pytest
from scipy.integrate import trapezoid

from geometry.errors import UserError
from solvers.fem.equilibrium import DiscreteEquilibrium
from solvers.fem.finite_strain.load_path import PENETRATION
from solvers.fem.finite_strain.solver import FemNonlinearSolver
from solvers.fem.linear import FemSolver
from solvers.problem import Load, Material, Problem, contact_ends
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
        ({"kind": "cylinder"}, "a radius belongs to the load cylinder"),  # none
        ({"kind": "mean", "radius": 5.0}, "a radius belongs to the load cylinder"),  # one too many
        ({"kind": "cylinder", "radius": -1.0}, "greater than 0"),
        ({"kind": "cylinder", "radius": 5.0, "displacement": (None, -1.0)}, "has no friction"),
        ({"kind": "cylinder", "radius": 5.0, "displacement": (0.0, 0.0)}, "does not move"),
    ],
)
def test_a_cylinder_that_makes_no_sense_is_refused(values, said):
    with pytest.raises(ValueError, match=said):
        Load(**values)

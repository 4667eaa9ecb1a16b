"""Load paths: steps that end where they are asked to, and paths that end before the full load."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.solvers.fem.finite_strain.load_path import LoadPath, LoadSteps
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.problem import Load, Material, Problem
from tests.solvers.conftest import bar_mesh


def arch():
    """Two straight legs over 84 mm that rise by 8 mm, 1.2 mm thick, held at both feet."""
    flat = bar_mesh(84.0, 1.2, 42, 1, contact=(40.0, 44.0))
    edges, (x, y) = flat.boundary_edges, flat.points.T
    at_feet = (x[edges] == 0).all(axis=1) | (x[edges] == 84).all(axis=1)
    points = np.column_stack([x, y - 8.0 * np.maximum(np.abs(x - 42.0) - 4.0, 0.0) / 38.0])
    return replace(flat, points=points, boundaries={**flat.boundaries, "base": edges[at_feet]})


ARCH = Problem(arch(), Material(young=10.0, poisson=0.3, law="neo-hookean"))


def test_the_force_at_a_stop_is_that_of_a_run_that_ends_there():
    """Between steps of Newton's choice the force of an arch that snaps is far from a straight line."""
    stop, load = 0.2, Load("cylinder", radius=5.0, stroke=3.0)
    through = FemNonlinearSolver(stops=(stop,)).solve(replace(ARCH, load=load))
    ended = FemNonlinearSolver().solve(replace(ARCH, load=Load("cylinder", radius=5.0, stroke=0.6)))
    fractions = through.history["load_fraction"]
    assert {stop, 0.25, 0.5, 0.75, 1.0} <= set(fractions.tolist())
    (force,) = through.history["reaction_y"][fractions == stop]
    assert force == pytest.approx(ended.reaction[1], rel=1e-4)
    between = np.interp(
        stop, *(through.history[name][fractions != stop] for name in ("load_fraction", "reaction_y"))
    )
    assert abs(between / force - 1) > 0.01


def test_an_arch_that_snaps_away_from_a_cylinder_says_where():
    found = FemNonlinearSolver().solve(replace(ARCH, load=Load("cylinder", radius=5.0, stroke=12.0)))
    assert not found.status.converged
    assert "the finger snaps away from the cylinder at 8.94" in found.status.message
    forces = -found.history["reaction_y"]
    assert forces[-1] < 0.05 * forces.max()


@pytest.mark.parametrize(("power", "said"), [(0.5, "a limit point at 4.99"), (1.0, "Newton's method fails")])
def test_a_path_that_moves_ever_farther_ends_at_a_limit_point(power, said):
    """Near it the displacement grows with the root of the distance in load."""
    problem = replace(ARCH, load=Load(stroke=10.0))
    path = LoadPath(problem, LagrangeSpace(problem.mesh, 2), steps=LoadSteps())
    rest = path.equilibrium.rest
    fractions = 0.5 - np.array([0.5, 0.4, 0.3, 0.2, 0.1, 0.05, 0.01, 0.001])
    path.points = [
        replace(rest, fraction=each, nodal=rest.nodal + 0.5**power - (0.5 - each) ** power)
        for each in fractions
    ]
    assert said in path.phrase
    path.close()

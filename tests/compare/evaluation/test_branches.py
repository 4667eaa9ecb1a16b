"""Two stable equilibria of one load: a column that bends to either side."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.comparison.evaluation.branches import with_branches
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.geometry.section.loop import Loop
from pinnray.geometry.section.section import Section
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver, equilibria_near
from pinnray.solvers.lagrange import LagrangeField, LagrangeSpace
from pinnray.solvers.problem import Load, Material, Problem
from tests.solvers.bodies import mesh_of

HEIGHT, HALF, BOW = 40.0, 1.0, 0.05


@pytest.fixture(scope="module")
def problem():
    """A slender column, a little bent, whose head is pressed down by many times what it bears straight."""
    corners = [(HALF, -HEIGHT), (HALF + BOW, -HEIGHT / 2), (HALF, 0.0)]
    corners += [(-HALF, 0.0), (BOW - HALF, -HEIGHT / 2), (-HALF, -HEIGHT)]
    section = Section(Loop(np.array(corners), np.zeros(6), ("", "", "front", "", "", "base")))
    mesh = mesh_of(section, 0.0, 1.0, 2 * HALF)
    return Problem(mesh, Material(law="neo-hookean"), Load(kind="mean", displacement=(None, -1.0)))


@pytest.fixture(scope="module")
def solutions(problem):
    """The column bent to the side of its own bow, and to the other."""
    own = FemNonlinearSolver().solve(problem)
    space = LagrangeSpace(problem.mesh, 2)
    x, y = space.nodes.T
    powers = [(p, q) for p in range(2) for q in range(8)]
    terms = np.column_stack([x**p * (y / HEIGHT) ** q for p, q in powers])
    fitted = np.linalg.lstsq(terms, own.field.values, rcond=None)[0]  # type: ignore[attr-defined]
    mirrored = (terms * [(-1) ** p for p, _ in powers]) @ fitted * [-1, 1]
    (across,) = equilibria_near(problem, [mirrored])
    other = replace(
        own, solver="other", field=LagrangeField(space, across.nodal), energy=across.energy, error=None
    )
    return own, other


def evaluations(problem, *solutions):
    return [Evaluation.of(solution, problem.mesh) for solution in solutions]


def test_the_one_of_higher_energy_says_so(problem, solutions):
    judged, remarks = with_branches(evaluations(problem, *solutions), problem)
    by_energy = sorted(judged, key=lambda evaluation: evaluation.energy)
    least, most = by_energy
    assert most.energy > least.energy * (1 + 1e-4)
    assert "NOT THE EQUILIBRIUM OF LEAST ENERGY" in most.message
    assert f"which {least.solver} found" in most.message
    assert "of several stable equilibria the one of least energy" in least.message
    assert f"{most.solver} has" in least.message
    (remark,) = remarks
    assert remark.startswith("2 stable equilibria under this load")


def test_energies_are_those_of_the_same_elements_whatever_a_solver_reports(problem, solutions):
    """A network's quadrature may report too little by more than the branches differ by."""
    own, other = solutions
    least = min(solutions, key=lambda solution: solution.energy)
    falsified = [replace(each, energy=10.0 if each is least else 0.1) for each in (own, other)]
    judged, _ = with_branches(evaluations(problem, *falsified), problem)
    (first,) = [each for each in judged if "one of least energy;" in each.message]
    assert first.solver == least.solver


def test_an_inexact_result_is_no_branch(problem, solutions):
    """Two results that differ by 2 % lead to one equilibrium."""
    own, _ = solutions
    off = replace(own, solver="off", field=LagrangeField(own.field.space, 1.02 * own.field.values))
    before = evaluations(problem, own, off)
    judged, remarks = with_branches(before, problem)
    assert not remarks
    assert [each.message for each in judged] == [each.message for each in before]


def test_results_that_agree_are_not_looked_at(problem, solutions, monkeypatch):
    own, _ = solutions
    monkeypatch.setattr("pinnray.solvers.fem.finite_strain.solver.equilibria_near", None)
    assert with_branches(evaluations(problem, own, replace(own, solver="again")), problem)[1] == []


def test_a_result_beside_which_there_is_no_equilibrium_is_said(problem, solutions, monkeypatch):
    found = equilibria_near(problem, [solutions[0].field.values])
    monkeypatch.setattr("pinnray.solvers.fem.finite_strain.solver.equilibria_near", lambda *_: [*found, None])
    judged, remarks = with_branches(evaluations(problem, *solutions), problem)
    assert all("several" not in evaluation.message for evaluation in judged)
    (remark,) = remarks
    assert "no stable equilibrium was found on the elements of fem-nonlinear beside other:" in remark


def test_where_newton_leaps_away_the_energy_is_followed_down(problem, solutions, monkeypatch):
    """From the bent column with its bend halved between base and head; too far off for three iterations."""
    own, _ = solutions
    space = LagrangeSpace(problem.mesh, 2)
    share = 1 - 0.5 * np.sin(np.pi * space.nodes[:, 1:] / HEIGHT) ** 2
    monkeypatch.setattr("pinnray.solvers.fem.finite_strain.solver.ITERATIONS", 3)
    start = own.field.values * np.hstack([share, np.ones_like(share)])
    (found,) = equilibria_near(problem, [start])
    assert found is not None
    assert found.energy == pytest.approx(own.energy, rel=1e-6)
    monkeypatch.setattr("pinnray.solvers.fem.finite_strain.load_path.descended", lambda *_: None)
    assert equilibria_near(problem, [start]) == [None]

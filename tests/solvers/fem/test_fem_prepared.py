"""One factorisation for many loads, and the choice of the linear solver."""

import numpy as np
import pytest

from pinnray.runtime.errors import UserError
from pinnray.solvers.fem import equilibrium, linear_solvers
from pinnray.solvers.fem.equilibrium import DiscreteEquilibrium
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.fem.linear_solvers import Factorisation
from pinnray.solvers.problem import Load, Problem


@pytest.fixture
def factorised(monkeypatch):
    """The masks of held components of every factorisation of the test."""
    masks = []
    factorise = DiscreteEquilibrium.factorised

    def counted(system, clamped):
        masks.append(clamped)
        return factorise(system, clamped)

    monkeypatch.setattr(DiscreteEquilibrium, "factorised", counted)
    return masks


def relative(difference, reference):
    return np.linalg.norm(difference) / np.linalg.norm(reference)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("loads", "factorisations"),
    [
        ([Load(), Load(displacement=(0.0, -3.0)), Load(displacement=(1.0, 2.0))], 1),  # strokes
        ([Load(), Load(displacement=(None, -10.0)), Load(kind="point")], 1),  # other functionals
        ([Load(), Load(position=50.3), Load(position=21.0)], 1),  # contacts elsewhere
        ([Load(kind="patch"), Load(kind="patch", displacement=(0.0, -3.0))], 1),
        ([Load(), Load(kind="patch"), Load(kind="patch", displacement=(None, -3.0))], 3),  # nodes held
    ],
)
def test_loads_share_a_factorisation_and_solutions_are_those_of_fresh_solves(
    coarse_mesh, factorised, loads, factorisations
):
    prepared = FemSolver().prepare(Problem(coarse_mesh, load=loads[0]))
    solutions = [prepared.solve(load) for load in loads]
    assert len(factorised) == factorisations
    for load, solution in zip(loads, solutions, strict=True):
        fresh = FemSolver().solve(Problem(coarse_mesh, load=load))
        assert relative(solution.field.values - fresh.field.values, fresh.field.values) < 1e-9  # type: ignore[attr-defined]
        np.testing.assert_allclose(solution.reaction, fresh.reaction, atol=1e-8)
        assert solution.energy == pytest.approx(fresh.energy, rel=1e-9)
        assert solution.problem.load == load


def test_another_stroke_costs_no_solve(coarse_mesh, monkeypatch):
    prepared = FemSolver(estimate=False).prepare(Problem(coarse_mesh))
    monkeypatch.setattr(Factorisation, "solve", None)
    solution = prepared.solve(Load(displacement=(0.0, -3.0)))
    assert solution.displacement(coarse_mesh.points[[coarse_mesh.contact_node]])[0, 1] < -2.9


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("kind", ["mean", "patch"])
def test_iterations_find_what_the_factorisation_finds(coarse_mesh, degree, kind):
    """To 1e-7: the residual tolerance of 1e-10 times the root of the finger's condition."""
    problem = Problem(coarse_mesh, load=Load(kind=kind))
    direct, iterative = (
        FemSolver(degree=degree, linear_solver=name).solve(problem) for name in ("direct", "iterative")
    )
    difference = relative(iterative.field.values - direct.field.values, direct.field.values)  # type: ignore[attr-defined]
    assert difference < 1e-7
    np.testing.assert_allclose(iterative.reaction, direct.reaction, rtol=1e-6, atol=1e-8)
    assert (direct.stats["linear_solver"], iterative.stats["linear_solver"]) == ("direct", "iterative")
    assert 10 < iterative.stats["iterations"] < 400


def test_iterations_that_do_not_converge_are_an_error(coarse_mesh, monkeypatch):
    monkeypatch.setattr(linear_solvers, "MAX_ITERATIONS", 3)
    with pytest.raises(UserError, match=r"after 3 iterations .* take linear_solver=direct"):
        FemSolver(linear_solver="iterative").solve(Problem(coarse_mesh))


def test_many_unknowns_are_solved_by_iterations(coarse_mesh, monkeypatch):
    monkeypatch.setattr(equilibrium, "ITERATIVE_BEYOND", 2 * len(coarse_mesh.points))
    found = [FemSolver(degree, estimate=False).solve(Problem(coarse_mesh)) for degree in (1, 2)]
    assert [each.stats["linear_solver"] for each in found] == ["direct", "iterative"]

"""One factorisation for many loads, and the choice of the linear solver."""

import numpy as np
import pytest

from pinnray.solvers.fem.equilibrium import DiscreteEquilibrium
from pinnray.solvers.fem.factorisation import Factorisation
from pinnray.solvers.fem.linear import FemSolver
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

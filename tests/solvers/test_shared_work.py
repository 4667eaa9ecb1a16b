"""Work that solvers of one problem share: done once, and with the results of work that is not shared."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.comparison.evaluation.certifier import with_certificates
from pinnray.comparison.evaluation.evaluation import evaluated
from pinnray.geometry.finger.design import Design
from pinnray.solvers.fem.factorisation import Factorisation
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.finger_figures import figures_at_rest
from pinnray.solvers.pinn.finite_basis.presets import PinnAsmSolver, PinnLocalSolver, PinnStdSolver
from pinnray.solvers.problem import Load, Problem
from pinnray.solvers.shared_work import SharedWork, shared
from pinnray.solvers.symmetric_factors import BlockMatrix
from tests.solvers.conftest import observed_at

QUICK = {"wall_spacing": 1.2, "corner_spacing": 0.3, "neurons": 3, "tolerance": 0.05}


@pytest.fixture
def factorisations(monkeypatch):
    """A list with the size of every matrix of a network that is factorised."""
    sizes: list[int] = []
    factorise = BlockMatrix.factorised

    def counted(matrix, *arguments, **settings):
        sizes.append(matrix.size)
        return factorise(matrix, *arguments, **settings)

    monkeypatch.setattr(BlockMatrix, "factorised", counted)
    return sizes


@pytest.fixture
def observed(coarse_mesh) -> Problem:
    markers = coarse_mesh.markers
    moved = [0.2, -6.5] * (markers[:, :1] / 90) ** 2
    return Problem(coarse_mesh, observations=observed_at(markers, moved, 0.0))


def test_a_result_is_made_once_and_is_gone_outside():
    made: list[int] = []

    def make() -> int:
        made.append(len(made))
        return made[-1]

    work = SharedWork()
    with work.used():
        assert [shared("a", make), shared("a", make), shared("b", make)] == [0, 0, 1]
    assert shared("a", make) == 2
    with SharedWork().used():
        assert shared("a", make) == 3
    with work.used():
        assert shared("a", make) == 0
        with pytest.raises(ZeroDivisionError):
            shared("c", lambda: 1 // 0)
        assert shared("c", lambda: 1) == 1


@pytest.mark.slow
def test_markers_cost_no_factorisation_where_the_network_without_them_was_solved(observed, factorisations):
    plain = replace(observed, observations=None)
    with SharedWork().used():
        without = PinnStdSolver(**QUICK).solve(plain)
        levels = len(factorisations)
        found = PinnAsmSolver(**QUICK).solve(observed)
    assert len(factorisations) == levels == len(without.history["units"])
    alone = PinnAsmSolver(**QUICK).solve(observed)
    assert len(factorisations) == 2 * levels
    points = observed.mesh.points
    np.testing.assert_array_equal(found.displacement(points), alone.displacement(points))
    np.testing.assert_array_equal(found.left_out, alone.left_out)
    assert found.energy == alone.energy
    assert np.abs(found.displacement(points) - without.displacement(points)).max() > 0.1


@pytest.mark.slow
def test_solvers_of_the_linear_law_share_one_factorisation_of_the_body(observed, monkeypatch):
    """The solution, the figures at rest and the certificate: with the numbers of each."""
    made: list[object] = []
    update = Factorisation.update
    monkeypatch.setattr(
        Factorisation, "update", lambda self, *state: made.append(self) or update(self, *state)
    )
    plain = replace(observed, observations=None, finger=Design())

    def found():
        solution = FemSolver().solve(plain)
        figures = figures_at_rest(plain)
        (certified,) = with_certificates([evaluated(solution, plain.mesh)], plain)
        nodal = solution.displacement(plain.mesh.points)
        return [nodal, solution.error.markers, *figures.values(), certified.certificate.energy]

    with SharedWork().used():
        shared_numbers = found()
    assert len(made) == 1
    for one, other in zip(found(), shared_numbers, strict=True):
        np.testing.assert_array_equal(one, other)
    assert len(made) > 3


@pytest.mark.slow
@pytest.mark.parametrize(
    ("solver", "load"),
    [
        (PinnStdSolver(**QUICK, seed=1), Load()),  # another network
        (PinnLocalSolver(**QUICK), Load()),  # other windows
        (PinnStdSolver(**QUICK), Load(position=50.0)),  # windows are denser at the contact
    ],
)
def test_what_differs_is_not_shared(coarse_mesh, factorisations, solver, load):
    with SharedWork().used():
        first = PinnStdSolver(**QUICK).solve(Problem(coarse_mesh))
        second = solver.solve(Problem(coarse_mesh, load=load))
    assert len(factorisations) == len(first.history["units"]) + len(second.history["units"])


def test_the_energy_by_the_forces_work_is_that_of_the_quadrature(observed):
    """Also with springs: their energy is not the body's."""
    level = PinnAsmSolver(**QUICK, asm_weight=0.01).level(observed, 1.0)
    state = level.step(level.zero_output)
    assert state.energy == pytest.approx(level.energy.total(state.output), rel=1e-9)
    work = 0.5 * float(state.forces @ level.targets)
    assert abs(work / state.energy - 1) > 0.01

"""`fem-asm` at finite strain: limits, Taylor tests, refits, the work of the indenter and a twin."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.solvers.assimilation.misfit import MarkerSettings
from pinnray.solvers.fem.assimilating import FemAsmSolver
from pinnray.solvers.fem.boundary_conditions import DisplacementConstraints
from pinnray.solvers.fem.equilibrium import DiscreteEquilibrium
from pinnray.solvers.fem.finite_strain.load_path import LoadPath
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.problem import Load, Material, Problem, contact_functional
from tests.solvers.conftest import bar_mesh, distances, hiding, observed_at

MESH = bar_mesh(20.0, 2.0, 20, 2, contact=(16.0, 20.0))
MARKERS = np.array([[4.0, -1.0], [9.0, -0.9], [13.0, -1.1], [18.0, -1.0]])
SOFT = FemAsmSolver(degree=1, weights="precision", scale=0.05)
"""Neither the cantilever nor the markers have it their own way."""


def pulled(load, *, law="neo-hookean", hidden=(), size=0.3) -> Problem:
    """A cantilever whose markers are a part of a millimetre from where `fem-nonlinear` has them."""
    random = np.random.default_rng(3)
    problem = Problem(MESH, Material(law=law), load)
    moved = FemNonlinearSolver(degree=1).solve(problem).displacement(MARKERS)
    visible = ~np.isin(np.arange(len(MARKERS)), hidden)
    moved = moved + size * random.normal(size=MARKERS.shape)
    deviations = random.uniform(0.02, 0.2, MARKERS.shape)
    return replace(problem, observations=observed_at(MARKERS, moved, deviations, visible))


BENT = Load(displacement=(None, -6.0))


@pytest.fixture(scope="module")
def bent() -> Problem:
    return pulled(BENT)


@pytest.mark.parametrize(
    ("kind", "law"), [("mean", "neo-hookean"), ("point", "st-venant-kirchhoff"), ("patch", "neo-hookean")]
)
def test_weak_weights_give_fem_nonlinear(kind, law):
    problem = pulled(Load(kind=kind, displacement=(None, -3.0)), law=law)
    plain = FemNonlinearSolver(degree=1).solve(replace(problem, observations=None))
    weak = FemAsmSolver(degree=1, asm_weight=1e-12).solve(problem)
    assert weak.status.converged
    np.testing.assert_allclose(weak.field.values, plain.field.values, atol=1e-6)  # type: ignore[attr-defined]
    assert weak.energy == pytest.approx(plain.energy, rel=1e-6)
    np.testing.assert_allclose(weak.reaction, plain.reaction, atol=1e-6 * np.abs(plain.reaction).max())


@pytest.mark.parametrize("kind", ["mean", "patch"])
def test_small_displacements_give_the_linear_minimiser(kind):
    """The relative distance from it falls with the size of the displacements."""
    problem = pulled(Load(kind=kind, displacement=(0.1, -1.0)))
    distances = []
    for size in (0.02, 0.01):
        load = Load(kind=kind, displacement=(0.1 * size, -size))
        seen = replace(problem.observations, displacements=size * problem.observations.displacements)
        own = replace(problem, load=load, observations=seen)
        stiff = SOFT.solve(own).field.values  # type: ignore[attr-defined]
        linear = SOFT.solve(replace(own, material=Material())).field.values  # type: ignore[attr-defined]
        distances.append(np.linalg.norm(stiff - linear) / np.linalg.norm(linear))
    assert distances[1] < 0.02
    assert np.log2(distances[0] / distances[1]) == pytest.approx(1.0, abs=0.1)


def functional(problem, space):
    """J of nodal displacements without any multipliers, and a step (N, 2) that keeps base and contact."""
    constraints = DisplacementConstraints.of(problem, space)
    misfit = MarkerSettings(weights="precision", scale=SOFT.scale).misfit(problem)
    constraints = constraints.joined(DisplacementConstraints.springs(misfit, space))
    equilibrium = DiscreteEquilibrium(problem, space, constraints)
    points, weights = misfit.sampling()
    sampling = weights @ space.shape_functions(problem.mesh.locate(points)).toarray()
    contact, average = contact_functional(problem)
    row = average @ space.shape_functions(problem.mesh.locate(contact)).toarray()

    def total(nodal):
        return equilibrium.energy(nodal) + misfit.value(sampling @ nodal)

    def admissible(step):
        step = np.where(equilibrium.clamped, 0.0, step)
        moved = (row @ step) * np.isin([0, 1], problem.load.prescribed)
        return step - np.outer(row, moved) / (row @ row)

    return total, admissible


def test_it_is_stationary_and_a_minimum_nearby(bent):
    solution = SOFT.solve(bent)
    space = solution.field.space  # type: ignore[attr-defined]
    total, admissible = functional(bent, space)
    least, random = total(solution.field.values), np.random.default_rng(1)  # type: ignore[attr-defined]
    for _ in range(3):
        step = admissible(1e-3 * random.normal(size=space.nodes.shape))
        up, down = (total(solution.field.values + sign * step) - least for sign in (1, -1))  # type: ignore[attr-defined]
        assert min(up, down) > 0
        assert abs(up - down) < 1e-2 * up


def test_the_indenter_s_force_is_the_slope_of_energy_plus_misfit(bent):
    """Of its least value over the load, while the observations stay."""
    far, near = (SOFT.solve(replace(bent, load=Load(displacement=(None, v)))) for v in (-6.01, -5.99))
    rise = near.energy + near.stats["misfit"] - far.energy - far.stats["misfit"]
    assert SOFT.solve(bent).reaction[1] == pytest.approx(rise / 0.02, rel=1e-4)


@pytest.mark.parametrize("relaxed", [True, False])
def test_leaving_a_marker_out_is_solving_without_it(relaxed, monkeypatch):
    """Whether Newton's method can go on from the solution or has to start from rest."""
    problem = pulled(BENT, hidden=(1,))
    if not relaxed:
        monkeypatch.setattr(LoadPath, "relaxed", lambda path, kept: None)
    solution = SOFT.solve(problem)
    assert np.isnan(solution.left_out[1]).all()
    marker = 2
    without = SOFT.solve(hiding(problem, marker))
    disc = replace(MarkerSettings().misfit(problem), points=MARKERS[[marker]])
    points, weights = replace(disc, observed=disc.observed[:1], weights=disc.weights[:1]).sampling()
    expected = weights @ without.displacement(points)
    np.testing.assert_allclose(solution.left_out[[marker]], expected, atol=1e-6)
    assert np.abs(expected - solution.displacement(MARKERS[[marker]])).max() > 0.05


def test_a_twin_is_met_in_displacement_and_in_stress():
    """With the errors of a camera; a linear model that meets the markers must strain to follow them."""
    stiff = Problem(MESH, Material(law="neo-hookean"), BENT)
    truth = FemNonlinearSolver().solve(stiff)
    errors = 0.01 * np.random.default_rng(2).normal(size=MARKERS.shape)
    twin = replace(stiff, observations=observed_at(MARKERS, truth.displacement(MARKERS) + errors, 0.01))
    solver = FemAsmSolver(weights="precision", scale=0.001)
    solution, linear = (solver.solve(each) for each in (twin, replace(twin, material=Material())))
    np.testing.assert_allclose(solution.displacement(MARKERS), truth.displacement(MARKERS), atol=0.04)
    assert distances(solution, truth)[1] < 0.1
    assert distances(linear, truth)[1] > 1


def test_a_load_that_is_not_reached_is_said():
    """Two markers are to change places, which would turn the cantilever inside out."""
    problem = pulled(BENT, hidden=(0, 3))
    crossed = problem.observations.displacements + np.array([[0.0, 0], [8, 0], [-8, 0], [0, 0]])
    observations = replace(problem.observations, displacements=crossed)
    solution = FemAsmSolver(degree=1).solve(replace(problem, observations=observations))
    assert not solution.status.converged
    assert solution.left_out is None


def test_without_markers_it_is_fem_nonlinear(bent):
    alone = replace(bent, observations=None)
    solution = FemAsmSolver().solve(alone)
    np.testing.assert_array_equal(solution.field.values, FemNonlinearSolver().solve(alone).field.values)  # type: ignore[attr-defined]
    assert solution.solver == "fem-asm"

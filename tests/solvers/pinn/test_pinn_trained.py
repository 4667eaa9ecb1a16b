"""The preset `trained`: derivatives by the neurons, what the training gains, and what it keeps."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.pinn.finite_basis.constrained_network import ConstrainedNetwork
from pinnray.solvers.pinn.finite_basis.newton import find_equilibrium
from pinnray.solvers.pinn.finite_basis.presets import PinnLocalSolver, TrainedPinnAsmSolver, TrainedPinnSolver
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.solver import NoSolutionError
from tests.solvers.conftest import bar_mesh, distances, observed_at

pytestmark = pytest.mark.slow

SMALL = {"wall_spacing": 1.6, "corner_spacing": 0.4, "neurons": 3, "tolerance": 0.2}
STEPS = {**SMALL, "steps": 20}


@pytest.fixture(scope="module")
def problem(short_mesh) -> Problem:
    return Problem(short_mesh)


@pytest.fixture(scope="module")
def bent() -> Problem:
    """A neo-Hookean cantilever whose end is pressed down by a tenth of its length."""
    mesh = bar_mesh(40.0, 4.0, 40, 4, contact=(36.0, 40.0))
    return Problem(mesh, Material(law="neo-hookean"), Load(displacement=(None, -4.0)))


@pytest.fixture(scope="module")
def trained(problem):
    return TrainedPinnSolver(**STEPS).solve(problem)


def with_markers(problem: Problem, factor: float) -> Problem:
    """A problem with markers that have moved by a factor of what `fem` finds."""
    markers = problem.mesh.points[::97]
    seen = factor * FemSolver(estimate=False).solve(problem).displacement(markers)
    return replace(problem, observations=observed_at(markers, seen, 0.01))


@pytest.mark.parametrize("load", [Load(), Load(kind="patch"), Load(displacement=(0.5, -2.0))])
@pytest.mark.parametrize("markers", [False, True])
def test_slopes_are_those_of_the_least_energy(problem, load, markers):
    """Central differences of the energy with the misfit, each with its own exact output layer."""
    solver = (TrainedPinnAsmSolver if markers else TrainedPinnSolver)(**SMALL)
    given = replace(problem, load=load)
    level = solver.level(with_markers(given, 1.1) if markers else given, 1.0)
    differences(level, level.step(level.zero_output))


def test_slopes_at_finite_strain_are_those_of_the_least_energy(bent):
    level = TrainedPinnSolver(**SMALL).level(bent, 1.0)
    guess = level.step(level.zero_output, 0.1).output
    for fraction in np.linspace(0.2, 1.0, 9):
        state, _ = find_equilibrium(level, guess, fraction)
        guess = state.output
    differences(level, state)


def differences(level, state) -> None:
    """Compare the slopes of a level at its equilibrium with differences along a random direction."""
    _, slopes = level.least(state)
    neurons = level.energy.basis.neurons
    direction = torch.from_numpy(np.random.default_rng(0).normal(size=tuple(neurons.shape)))
    direction[:2] *= 0.1

    def least(step: float) -> float:
        other = level.with_neurons(neurons + step * direction, state.factor)
        linear = level.energy.material.law == "linear"
        there = other.step(other.zero_output) if linear else find_equilibrium(other, state.output, 1.0)[0]
        return other.least(there)[0]

    wide, narrow = ((least(step) - least(-step)) / (2 * step) for step in (1e-3, 5e-4))
    expected = (4 * narrow - wide) / 3  # Richardson's extrapolation, for smaller steps end in rounding
    assert float((slopes * direction).sum()) == pytest.approx(expected, rel=2e-3)


def test_training_lowers_the_energy_and_the_distance_from_finite_elements(problem, trained):
    """Measured: 1.6 against 2.4 % with the neurons as they are drawn; 12 against 20 % more energy."""
    fem = FemSolver(estimate=False).solve(problem)
    drawn = PinnLocalSolver(**SMALL, growth=0.8).solve(problem)
    assert trained.stats["units"] == drawn.stats["units"]
    assert 0 < trained.energy - fem.energy < 0.7 * (drawn.energy - fem.energy)
    assert distances(trained, fem)[0] < 0.8 * distances(drawn, fem)[0]


def test_training_repeats_to_the_bit_and_seeds_differ(problem):
    short = {**SMALL, "steps": 1}
    first, again, other = (TrainedPinnSolver(**short, seed=seed).solve(problem).energy for seed in (0, 0, 1))
    assert first == again != other


@pytest.mark.filterwarnings("error")
def test_a_finger_that_is_not_moved_stays_at_rest(problem):
    found = TrainedPinnSolver(**STEPS).solve(replace(problem, load=Load(displacement=(0.0, 0.0))))
    assert found.energy == pytest.approx(0.0, abs=1e-12)


def test_the_reaction_is_the_slope_of_the_energy(trained):
    """By Clapeyron's theorem, up to what regularises the factorisation."""
    work = 0.5 * trained.reaction[1] * trained.problem.load.displacement[1]
    assert trained.energy == pytest.approx(work, rel=1e-4)


def test_finite_strain_is_trained_too(bent):
    """Measured: 0.08 % from finite elements; 1.1 % less energy than with the neurons as they are drawn."""
    drawn = PinnLocalSolver(**SMALL, growth=0.8).solve(bent)
    found = TrainedPinnSolver(**STEPS).solve(bent)
    assert found.status.converged, found.status.message
    assert found.energy < 0.993 * drawn.energy
    assert distances(found, FemNonlinearSolver().solve(bent))[0] < 0.002


@pytest.mark.parametrize("law", ["linear", "neo-hookean"])
def test_a_step_from_a_displacement_of_the_network_is_newtons(bent, law):
    level = TrainedPinnSolver(**SMALL).level(replace(bent, material=Material(law=law)), 1.0)
    output = level.step(level.zero_output, 0.1).output
    expected = level.step(output, 1.0)
    found = level.step_from(level.energy.gradients(output[None])[0])
    torch.testing.assert_close(found.output, expected.output, rtol=0, atol=1e-6)
    np.testing.assert_allclose(found.forces, expected.forces, rtol=1e-6)


def test_a_training_that_ends_beside_no_equilibrium_says_so(bent, monkeypatch):
    monkeypatch.setattr("pinnray.solvers.pinn.finite_basis.training.find_equilibrium", lambda *_: (None, 3))
    with pytest.raises(NoSolutionError, match="no equilibrium near"):
        TrainedPinnSolver(**STEPS).solve(bent)


def test_neurons_that_turn_a_point_inside_out_are_left_out(bent, monkeypatch):
    """The training ends with the best that it has."""
    step = ConstrainedNetwork.step_from

    def leap(*given):
        found = step(*given)
        return found._replace(output=50 * found.output)

    monkeypatch.setattr(ConstrainedNetwork, "step_from", leap)
    drawn = PinnLocalSolver(**SMALL, growth=0.8).solve(bent)
    assert TrainedPinnSolver(**STEPS).solve(bent).energy == pytest.approx(drawn.energy, rel=1e-9)

"""`pinn-std --preset paper`: the same training as the plain one, to rounding, and how a training ends."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch

from pinnray.solvers.pinn.paper.modified_mlp import ModifiedMlp
from pinnray.solvers.pinn.paper.solver import PaperPinnSolver
from pinnray.solvers.pinn.paper.trained_field import assess_training
from pinnray.solvers.problem import Load, Material, Problem
from tests.solvers.pinn.autograd_reference import PlainPinn

TINY = {"width": 8, "layers": 2, "base_points": 20, "precision": "double"}


@pytest.mark.parametrize(
    ("settings", "material", "load"),
    [
        ({}, Material(), Load()),  # the default load
        ({}, Material(), Load(kind="point")),  # the paper's
        ({}, Material(plane="stress"), Load(displacement=(None, -10.0))),  # the printed law; u free
        ({"bc_weight": 10.0}, Material(poisson=0.3), Load()),
    ],
)
def test_first_epochs_of_every_variant(coarse_mesh, settings, material, load):
    solver = PaperPinnSolver(**TINY, epochs=5, **settings)
    problem = Problem(coarse_mesh, material, load)
    history = solver.solve(problem).history
    plain = PlainPinn(problem, solver)
    for epoch in range(5):
        ours = [history[name][epoch] for name in ("PDE", "BC", "total")]
        np.testing.assert_allclose(ours, plain.step(), rtol=1e-10)


def test_number_of_parameters():
    """The paper's 4 layers of 64."""
    network = ModifiedMlp()
    assert network.parameters == 13_121
    assert network.initial(0, torch.float32).shape == (2, 13_121)


def test_initial_weights_are_glorot_normal():
    """Within three standard errors of the mean and the deviation; biases are exactly zero."""
    network = ModifiedMlp(networks=3)
    first, gates, biases, output, output_bias = network.weights(network.initial(0, torch.float64))
    for matrix, fans in ((first[:, :, :-1], 66), *((gate, 128) for gate in gates), (output, 65)):
        assert matrix.std() == pytest.approx((2 / fans) ** 0.5, rel=3 / (2 * matrix.numel()) ** 0.5)
        assert abs(matrix.mean()) < 3 * matrix.std() / matrix.numel() ** 0.5
    assert max(bias.abs().max() for bias in (first[:, :, -1], *biases, output_bias)) == 0


class Scaled:
    """A displacement field times a factor."""

    def __init__(self, field, factor: float) -> None:
        self.field, self.factor = field, factor

    def displacement(self, location):
        return self.factor * self.field.displacement(location)

    def gradient(self, location):
        return self.factor * self.field.gradient(location)


def training(*energies: float) -> SimpleNamespace:
    """A training of 40 epochs whose last four have these energies."""
    history = np.full((40, 1), 1.0)
    history[-len(energies) :, 0] = energies
    return SimpleNamespace(epoch=40, columns=("energy",), history=history)


def test_energy_and_reaction_are_those_of_finite_elements(medium_fem):
    """The mean section force; both integrate the same field, whose sections balance up to the mesh."""
    energy, reaction, _ = assess_training(medium_fem.problem, medium_fem.field, training(1.0))
    assert energy == pytest.approx(medium_fem.energy, rel=0.01)
    np.testing.assert_allclose(reaction, medium_fem.reaction, rtol=0.02)


def test_a_free_component_has_no_reaction(medium_fem):
    problem = Problem(medium_fem.problem.mesh, load=Load(displacement=(None, -10.0)))
    _, reaction, _ = assess_training(problem, medium_fem.field, training(1.0))
    assert reaction[0] == 0
    assert reaction[1] < 0


@pytest.mark.parametrize(("share", "hidden"), [(0.6, False), (0.4, True)])
def test_energy_between_the_collocation_points_is_said(medium_fem, share, hidden):
    """The network sees a share of its energy; half is the limit."""
    problem, energies = medium_fem.problem, [share * medium_fem.energy] * 4
    *_, status = assess_training(problem, medium_fem.field, training(*energies))
    assert status.converged != hidden
    assert ("the displacement jumps between the points" in status.message) == hidden


@pytest.mark.parametrize(
    ("factor", "energies", "converged"),
    [
        (1.0, (1.0, 1.0, 1.005, 1.005), True),  # settled within 1 %, conditions met
        (1.0, (1.02, 1.0, 1.0, 1.02), True),  # noise about one mean
        (1.0, (1.0, 1.0, 0.98, 0.98), False),  # the energy still falls
        (0.98, (1.0, 1.0, 1.0, 1.0), False),  # the contact is 2 % short
    ],
)
def test_converged_means_settled_with_the_conditions_met(medium_fem, factor, energies, converged):
    *_, status = assess_training(medium_fem.problem, Scaled(medium_fem.field, factor), training(*energies))
    assert status.converged == converged
    assert f"by {'2.00%' if factor < 1 else '0.00%'} of the stroke" in status.message

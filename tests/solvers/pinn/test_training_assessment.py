"""Assessment of a trained network, tried on the field of finite elements."""

from types import SimpleNamespace

import numpy as np
import pytest

from solvers.pinn.paper.trained_field import assess_training
from solvers.problem import Load, Problem


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

"""Variable projection: the derivative of the least energy by the neurons."""

import pytest
import torch

from benchmarks.trained_neurons import lagrangian_gradient, with_neurons
from solvers.pinn.finite_basis.standard import PinnStdSolver
from solvers.problem import Problem


def test_gradient_is_that_of_the_least_energy(coarse_mesh):
    problem = Problem(coarse_mesh)
    level = PinnStdSolver(corner_spacing=0.2, neurons=2).level(problem, 2.0)
    drawn = level.energy.basis.neurons

    def least_energy(neurons: torch.Tensor) -> float:
        now = with_neurons(level, problem, neurons)
        return now.energy.total(now.step(now.zero_output).output)

    solved = level.step(level.zero_output)
    variable = drawn.clone().requires_grad_()
    forces = torch.from_numpy(level.reaction(solved.forces))
    lagrangian_gradient(level, variable, level.field(solved.output), forces, problem)
    direction = (
        torch.randn(drawn.shape, generator=torch.Generator().manual_seed(0), dtype=drawn.dtype) * drawn
    )
    step = 1e-4
    difference = (least_energy(drawn + step * direction) - least_energy(drawn - step * direction)) / (
        2 * step
    )
    assert float((variable.grad * direction).sum()) == pytest.approx(difference, rel=1e-3)

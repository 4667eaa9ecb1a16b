"""The neurons of `pinn-std` trained by L-BFGS, with the output layer solved exactly at each step.

This is variable projection: the output layer c(r) of least energy is a function of the neurons r, and by the
envelope theorem the derivative of E(c(r), r) is that of the Lagrangian at fixed c and forces.
"""

from collections.abc import Iterator
from dataclasses import replace

import torch

from solvers.pinn.finite_basis.constrained_network import ConstrainedNetwork
from solvers.pinn.finite_basis.energy import energy_density
from solvers.pinn.finite_basis.load_conditions import load_conditions
from solvers.pinn.finite_basis.network import FiniteBasisField
from solvers.pinn.finite_basis.standard import PinnStdSolver
from solvers.pinn.threading import boxes_around
from solvers.problem import Problem

SCALE = 2.0
"""Spacing relative to the solver's settings: few neurons, so that training can gain something."""


def trained_neurons(problem: Problem, seed: int = 0) -> Iterator[FiniteBasisField]:
    """The field after each evaluation of the energy; the first has the neurons as drawn."""
    level = PinnStdSolver(seed=seed).level(problem, SCALE)
    drawn = level.energy.basis.neurons
    scale = drawn[:2].norm(dim=0)  # so that all variables are of the same size
    variable = (drawn / scale).requires_grad_()
    stepper = torch.optim.LBFGS([variable], max_iter=1, history_size=50, line_search_fn="strong_wolfe")
    fields = []

    def closure() -> float:
        now = with_neurons(level, problem, (variable * scale).detach())
        solved = now.step(now.zero_output)
        if solved is None:
            return float("inf")
        field = now.field(solved.output)
        fields.append(field)
        stepper.zero_grad()
        neurons = variable * scale
        lagrangian_gradient(now, neurons, field, torch.from_numpy(now.reaction(solved.forces)), problem)
        return now.energy.total(solved.output)

    while True:
        stepper.step(closure)
        yield fields[-1]


def with_neurons(level: ConstrainedNetwork, problem: Problem, neurons: torch.Tensor) -> ConstrainedNetwork:
    """The level with other neurons, shape (3, m, c)."""
    basis = replace(level.energy.basis, neurons=neurons)
    conditions = load_conditions(problem)
    shape = (*level.load_shape, basis.windows.count, 2, basis.per_window)
    functionals = level.functionals.reshape(shape).copy()
    for row, axis in enumerate(problem.load.prescribed):
        functionals[row, :, :, axis] = basis.functionals(conditions.points, conditions.weights)
    return replace(
        level,
        energy=replace(level.energy, basis=basis),
        functionals=functionals.reshape(level.functionals.shape),
    )


def lagrangian_gradient(
    level: ConstrainedNetwork,
    neurons: torch.Tensor,
    field: FiniteBasisField,
    forces: torch.Tensor,
    problem: Problem,
) -> None:
    """Add the gradient of E - forces · load to the variables behind the neurons, patch by patch."""
    leaf = neurons.detach().requires_grad_()
    material = level.energy.material
    for patch in level.energy.patches:
        _, gradient = _field_and_gradient(field, leaf, patch.points, patch.near)
        weights = level.energy.weights[patch.rows]
        (weights @ energy_density(gradient, material.lame, material.law)).backward()
    conditions = load_conditions(problem)
    points = torch.from_numpy(conditions.points.copy())
    (near,) = field.basis.windows.near(boxes_around([points]))
    displacement, _ = _field_and_gradient(field, leaf, points, near)
    work = torch.from_numpy(conditions.weights[0].copy()) @ displacement[:, problem.load.prescribed] @ forces
    (-work).backward()
    neurons.backward(leaf.grad)


def _field_and_gradient(
    field: FiniteBasisField, neurons: torch.Tensor, points: torch.Tensor, near: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor]:
    """Displacement (n, 2) and its gradient (n, 2, 2), written plainly for automatic differentiation."""
    share, slopes = field.basis.windows.values_and_gradients(points, near)
    factor, *of_factor = field.basis.constraint.at(points)
    weights = neurons[:, :, near]
    neuron = torch.tanh(torch.einsum("nx,xmw->nmw", points, weights[:2]) + weights[2])
    output = field.output[near]
    encoder = torch.einsum("nmw,wim->nwi", neuron, output[:, :, 1:]) + output[:, :, 0]
    value = torch.einsum("nw,nwi->ni", share, encoder)
    columns = []
    for axis in range(2):
        inner = torch.einsum("nmw,mw,wim->nwi", 1 - neuron**2, weights[axis], output[:, :, 1:])
        along = torch.einsum("nw,nwi->ni", slopes[axis], encoder) + torch.einsum("nw,nwi->ni", share, inner)
        columns.append(factor * along + of_factor[axis] * value)
    return factor * value, torch.stack(columns, dim=-1)

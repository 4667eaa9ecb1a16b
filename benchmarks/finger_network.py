"""Modified MLPs with hard constraints, written plainly, for the training recipes.

Two modified MLPs N of the scaled position give u = f (N - m(f N) / m(f) + t / m(f)), with the factor f of the
clamp and the load's functional m, which is t, whatever the weights. The elastic energy is |r|² / 2 with three
residuals at each quadrature point. torch differentiates with respect to the weights.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch

from geometry.arrays import FloatArray
from geometry.mesh.point_location import LocatedPoints
from geometry.mesh.quadrature import body_quadrature
from solvers.pinn.finite_basis.hard_constraint import HardConstraint
from solvers.pinn.paper.loss import stiffness_matrix
from solvers.pinn.paper.modified_mlp import ModifiedMlp
from solvers.pinn.threading import map_in_threads, slices
from solvers.problem import Problem, contact_functional

BASE_LENGTH = 5.0
PIECE = 512


@dataclass(frozen=True, eq=False)
class FingerNetwork:
    """Networks for a problem; parameters are flat, of shape (p,).

    Attributes:
        problem: The problem, on the mesh of the quadrature rule.
        shape: The networks.
        degree: Degree of the quadrature rule.
    """

    problem: Problem
    shape: ModifiedMlp
    degree: int = 2

    @cached_property
    def points(self) -> torch.Tensor:
        """Quadrature points, shape (q, 2), mm."""
        return torch.tensor(body_quadrature(self.problem.mesh, self.degree).location.points)

    @cached_property
    def weights(self) -> torch.Tensor:
        """Their weights, shape (q,), mm²."""
        return torch.tensor(body_quadrature(self.problem.mesh, self.degree).weights)

    @cached_property
    def roots(self) -> torch.Tensor:
        """Matrix from (du/dx, du/dy, dv/dx, dv/dy) to the residuals, shape (3, 4), MPa^1/2."""
        values, vectors = np.linalg.eigh(stiffness_matrix(self.problem.material.lame))
        return torch.tensor(np.sqrt(values[1:, None]) * vectors.T[1:])

    @cached_property
    def _contact(self) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Points (k, 2), the functional over f, which acts on N, (k,), and the required mean of N, (2,)."""
        points, weights = contact_functional(self.problem)
        factored = HardConstraint.of(self.problem.mesh, BASE_LENGTH).at(points)[0][:, 0] * weights
        targets = np.array([value or 0.0 for value in self.problem.load.displacement]) / factored.sum()
        return torch.tensor(points), torch.tensor(factored / factored.sum()), torch.tensor(targets)

    def initial(self, seed: int) -> torch.Tensor:
        """Glorot-normal weights; the output layers are scaled to the stroke."""
        parameters = self.shape.initial(seed, torch.float64).flatten()
        self.output_layers(parameters).mul_(float(np.abs(self.problem.load.values).max()))
        return parameters

    def tensors(self, parameters: torch.Tensor) -> list[torch.Tensor]:
        """Weights and biases one by one, as views."""
        weights = self.shape.weights(parameters.view(self.shape.networks, -1))
        return [weights.first, *weights.gates, *weights.biases, weights.output, weights.output_bias]

    def output_layers(self, parameters: torch.Tensor) -> torch.Tensor:
        """Weights and bias of the output layers, a view of shape (2, width + 1)."""
        return parameters.view(self.shape.networks, -1)[:, -self.shape.width - 1 :]

    def shift(self, parameters: torch.Tensor) -> torch.Tensor:
        """Constants added to both networks to meet the load, shape (2,)."""
        points, functional, targets = (array.to(parameters.dtype) for array in self._contact)
        return targets - self._streams(parameters, points)[:, 0] @ functional

    def field(self, parameters: torch.Tensor) -> "NetworkField":
        """The displacement field."""
        return NetworkField(self, parameters.detach().double())

    def state(self, parameters: torch.Tensor, shift: torch.Tensor, points: torch.Tensor) -> torch.Tensor:
        """Displacement and its derivatives along x and y at points (n, 2): shape (2, 3, n)."""
        constraint = HardConstraint.of(self.problem.mesh, BASE_LENGTH)
        factor, *slopes = (part[:, 0] for part in constraint.at(points))
        streams = self._streams(parameters, points)
        value = streams[:, 0] + shift[:, None]
        return torch.stack(
            [factor * value, *(factor * streams[:, 1 + k] + slopes[k] * value for k in range(2))], dim=1
        )

    def residuals(
        self, parameters: torch.Tensor, shift: torch.Tensor, points: torch.Tensor, weights: torch.Tensor
    ) -> torch.Tensor:
        """Residuals at points with weights, shape (3, n)."""
        gradient = self.state(parameters, shift, points)[:, 1:].reshape(4, -1)
        return weights.sqrt() * (self.roots.to(parameters.dtype) @ gradient)

    def energy(self, parameters: torch.Tensor) -> tuple[float, torch.Tensor]:
        """The energy per depth, N mm/mm, and its derivatives, shape (p,)."""
        points, weights = self.points.to(parameters.dtype), self.weights.to(parameters.dtype)
        trained = parameters.detach().requires_grad_()
        shift = self.shift(trained)

        def piece(rows: slice) -> tuple[float, torch.Tensor, torch.Tensor]:
            leaf = shift.detach().requires_grad_()
            residuals = self.residuals(trained, leaf, points[rows], weights[rows])
            energy = 0.5 * (residuals * residuals).sum()
            return energy.item(), *torch.autograd.grad(energy, (trained, leaf))

        parts = map_in_threads(piece, slices(len(points), PIECE))
        energies, gradients, of_shift = zip(*parts, strict=True)
        through_shift = torch.autograd.grad(shift, trained, torch.stack(of_shift).sum(0))[0]
        return sum(energies), torch.stack(gradients).sum(0) + through_shift

    def _streams(self, parameters: torch.Tensor, points: torch.Tensor) -> torch.Tensor:
        """The networks' outputs and their derivatives along x and y, shape (2, 3, n)."""
        low, high = self.problem.mesh.points.min(axis=0), self.problem.mesh.points.max(axis=0)
        half = float((high - low).max() / 2)
        scaled = (points - points.new_tensor((low + high) / 2)) / half
        weights = self.shape.weights(parameters.view(self.shape.networks, -1))
        first = weights.first
        layers = _activated(
            (torch.cat([scaled, scaled.new_ones(len(points), 1)], dim=1) @ first)[:, :, None],
            first[:, :, :2, None].expand(-1, -1, -1, len(points), -1) / half,
        )
        base, step = layers[:, 0], layers[:, 1] - layers[:, 0]
        hidden = _blend(base, step, layers[:, 2])
        for matrix, bias in zip(weights.gates, weights.biases, strict=True):
            before = hidden @ matrix[:, None]
            gate = _activated(before[:, :1] + bias[:, None], before[:, 1:])
            hidden = _blend(base, step, gate)
        result = (hidden @ weights.output[:, None])[..., 0]
        return torch.cat([result[:, :1] + weights.output_bias[:, None], result[:, 1:]], dim=1)


@dataclass(frozen=True, eq=False)
class NetworkField:
    """Trained networks as a displacement field."""

    network: FingerNetwork
    parameters: torch.Tensor

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement, shape (n, 2), mm."""
        return self._state(location)[:, :, 0]

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 2, 2)."""
        return self._state(location)[:, :, 1:]

    def _state(self, location: LocatedPoints) -> FloatArray:
        points = torch.tensor(np.asarray(location.points))
        with torch.no_grad():
            shift = self.network.shift(self.parameters)

        @torch.no_grad()
        def piece(rows: slice) -> torch.Tensor:
            return self.network.state(self.parameters, shift, points[rows])

        return torch.cat(map_in_threads(piece, slices(len(points), PIECE)), dim=2).permute(2, 0, 1).numpy()


def _activated(value: torch.Tensor, slopes: torch.Tensor) -> torch.Tensor:
    """The hyperbolic tangent and its derivatives, streams along the axis before the points."""
    activated = value.tanh()
    return torch.cat([activated, (1 - activated * activated) * slopes], dim=-3)


def _blend(base: torch.Tensor, step: torch.Tensor, gate: torch.Tensor) -> torch.Tensor:
    """A + Z (B - A) with derivatives; streams are the second axis."""
    blend = base + gate[:, :1] * step
    return torch.cat([blend[:, :1], blend[:, 1:] + gate[:, 1:] * step[:, :1]], dim=1)

"""Random gates whose windows do not sum to one: `pinn-std` before its gates became a tree.

Unit j is (1 - Z_j) A_j + Z_j B_j with a neuron A_j, its negative B_j, and a gate that opens at the crossing
of two strips around a random point of the body. The output layer is solved exactly, as a dense system.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch

from geometry.arrays import FloatArray
from geometry.mesh.point_location import LocatedPoints
from geometry.mesh.quadrature import body_quadrature
from solvers.elasticity import Lame
from solvers.pinn.finite_basis.hard_constraint import HardConstraint
from solvers.problem import Problem, contact_functional

WIDTH, SLOPE, STEEPNESS = 3.0, 0.3, 2.0
"""Half width of the strips, mm; steepness of the neurons, 1/mm; steepness of the gates."""

ROUND = 500
"""Units added in one round."""


@dataclass(frozen=True, eq=False)
class RandomGates:
    """U units: neurons (3, U), strips (4, 3, U) and output layer (U, 2)."""

    factor: HardConstraint
    neurons: torch.Tensor
    strips: torch.Tensor
    output: torch.Tensor

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement, shape (n, 2), mm."""
        parts = torch.from_numpy(np.array(location.points)).split(2000)
        return torch.cat([self.units(part)[0] @ self.output for part in parts]).numpy()

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient, shape (n, 2, 2)."""
        parts = torch.from_numpy(np.array(location.points)).split(2000)
        found = [torch.stack([along @ self.output for along in self.units(part)[1:]], -1) for part in parts]
        return torch.cat(found).numpy()

    def units(self, points: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """The units and their derivatives along x and y, (n, U) each."""
        signs = STEEPNESS * torch.tensor([1.0, -1.0, 1.0, -1.0], dtype=points.dtype)
        hidden = torch.tanh(torch.einsum("nx,kxu->knu", points, self.strips[:, :2]) + self.strips[:, 2:])
        gate = torch.tanh(torch.einsum("k,knu->nu", signs, hidden) - 1.35 * STEEPNESS * 2 * np.tanh(1.0))
        neuron = torch.tanh(points @ self.neurons[:2] + self.neurons[2])
        mixed = neuron * (1 - 2 * gate)
        factor, *slopes = self.factor.at(points)
        found = [mixed * factor]
        for axis in range(2):
            opening = torch.einsum("k,knu,ku->nu", signs, 1 - hidden**2, self.strips[:, axis])
            along = (1 - neuron**2) * self.neurons[axis] * (1 - 2 * gate)
            along -= 2 * neuron * (1 - gate**2) * opening
            found.append(along * factor + mixed * slopes[axis])
        return found[0], found[1], found[2]


def random_gates(problem: Problem, seed: int = 0) -> Iterator[RandomGates]:
    """The field of least energy after each round of new units."""
    rng = np.random.default_rng(seed)
    mesh, factor = problem.mesh, HardConstraint.of(problem.mesh, 5.0)
    rule = body_quadrature(mesh)
    points, weights = (torch.from_numpy(np.array(a)) for a in (rule.location.points, rule.weights))
    contact, shares = (torch.from_numpy(np.array(a)) for a in contact_functional(problem))
    neurons, strips = torch.empty(3, 0).double(), torch.empty(4, 3, 0).double()
    while True:
        chosen = rng.choice(len(mesh.areas), ROUND, p=mesh.areas / mesh.areas.sum())
        drawn = np.einsum("nc,ncx->nx", rng.dirichlet(np.ones(3), ROUND), mesh.points[mesh.triangles[chosen]])
        new_neurons, new_strips = _drawn(drawn, rng)
        neurons, strips = torch.cat([neurons, new_neurons], -1), torch.cat([strips, new_strips], -1)
        network = RandomGates(factor, neurons, strips, torch.zeros(neurons.shape[1], 2).double())
        output = _least_energy(network, points, weights, contact, shares, problem)
        yield RandomGates(factor, neurons, strips, output)


def _drawn(centres: FloatArray, rng: np.random.Generator) -> tuple[torch.Tensor, torch.Tensor]:
    def through(slopes: FloatArray, offset: FloatArray | float) -> FloatArray:
        return np.concatenate([slopes, (offset - (centres.T * slopes).sum(axis=0))[None]])

    angles = rng.uniform(0, 2 * np.pi, (2, len(centres)))
    across, normal = (np.stack([np.cos(angle), np.sin(angle)]) for angle in angles)
    directions = (across, np.stack([-across[1], across[0]]))
    strips = [through(direction / WIDTH, offset) for direction in directions for offset in (1.0, -1.0)]
    encoders = through(SLOPE * normal, rng.uniform(-1, 1, len(centres)))
    return torch.from_numpy(encoders), torch.from_numpy(np.stack(strips))


def _least_energy(
    network: RandomGates,
    points: torch.Tensor,
    weights: torch.Tensor,
    contact: torch.Tensor,
    shares: torch.Tensor,
    problem: Problem,
) -> torch.Tensor:
    count = network.neurons.shape[1]
    matrix = torch.zeros(2 * count, 2 * count).double()
    for part, share in zip(points.split(4000), weights.split(4000), strict=True):
        x, y = (along * share.sqrt()[:, None] for along in network.units(part)[1:])
        matrix += _stiffness(x, y, problem.material.lame)
    functional = shares @ network.units(contact)[0]
    axes = problem.load.prescribed
    right = torch.zeros(2 * count, len(axes)).double()
    for column, axis in enumerate(axes):
        right[axis * count : (axis + 1) * count, column] = functional
    scale = matrix.diagonal().rsqrt()
    scaled = matrix * scale * scale[:, None] + 1e-13 * torch.eye(2 * count).double()
    responses = torch.cholesky_solve(right * scale[:, None], torch.linalg.cholesky(scaled)) * scale[:, None]
    forces = torch.linalg.solve(right.T @ responses, torch.from_numpy(problem.load.values))
    return (responses @ forces).view(2, count).T.contiguous()


def _stiffness(x: torch.Tensor, y: torch.Tensor, lame: Lame) -> torch.Tensor:
    xx, yy, xy = x.T @ x, y.T @ y, x.T @ y
    stiff, λ, μ = lame.λ + 2 * lame.μ, lame.λ, lame.μ
    off = λ * xy + μ * xy.T
    return torch.cat([torch.cat([stiff * xx + μ * yy, off], 1), torch.cat([off.T, stiff * yy + μ * xx], 1)])

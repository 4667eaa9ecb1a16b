"""One network for all loads of a finger, trained on the energy alone.

Its inputs are place, radius, direction and stroke, its outputs the amplitudes q of a finger's vibrations, and
corrections e: the displacement is sum q_i v_i + sum (q_i q_j / 2 + e_ij) v_ij with the vibrations'
derivatives v_ij, so that walls turn without stretching. Each step draws loads and a part of the triangles,
and goes down the elastic energy and that of a penalty for what enters the cylinder. No solution is seen.
"""

import math
import time
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import torch

from benchmarks.emulators.modes import FreeModes, Rule
from geometry.arrays import FloatArray
from solvers.elasticity import Lame
from solvers.lagrange import LagrangeSpace

VIBRATIONS, COUPLED = 60, 12
PENALTY = 5.0
"""Force of a node per length in the cylinder, N/mm per mm: at 0.3 N/mm nodes enter it by hundredths."""
BATCH, PART, RATE, LARGEST = 32, 6, 2e-3, 3.0
"""Loads a step, triangles over those that a step takes, learning rate, length of a gradient at most."""


@dataclass(frozen=True)
class Loads:
    """n loads: place, mm, radius, mm, direction, degrees, and share of the full stroke."""

    place: FloatArray
    radius: FloatArray
    direction: FloatArray
    share: FloatArray

    @classmethod
    def drawn(cls, generator: np.random.Generator, count: int, top: float) -> "Loads":
        """Over the ranges of docs/examples/loads.toml."""
        return cls(
            generator.uniform(25, 75, count),
            np.exp(generator.uniform(np.log(4), np.log(20), count)),
            generator.uniform(-15, 15, count),
            top * generator.uniform(0.02, 1, count),
        )

    def tensors(self, stroke: float) -> tuple[torch.Tensor, ...]:
        """Inputs of the network (n, 4), the cylinder's centre (n, 2), radius and share (n,)."""
        angle = np.radians(self.direction)
        way = stroke * self.share[:, None] * np.stack([np.sin(angle), -np.cos(angle)], axis=1)
        scaled = [
            (self.place - 50) / 25,
            (np.log(self.radius) - np.log(9)) / 0.8,
            self.direction / 15,
            2 * self.share - 1,
        ]
        centre = np.stack([self.place, self.radius], axis=1) + way
        return tuple(_single(each) for each in (np.stack(scaled, 1), centre, self.radius, self.share))


class Family(torch.nn.Module):
    """The network and the body."""

    def __init__(self, space: LagrangeSpace, lame: Lame, width: int) -> None:
        super().__init__()
        modes = FreeModes.of(space, lame, VIBRATIONS, COUPLED)
        self.vectors = np.concatenate([modes.vibrations, modes.derivatives])
        self.lame, count = lame, len(self.vectors)
        rule = Rule.of(space, few=True)
        self.gradients = _single(rule.gradients(space, self.vectors).reshape(-1, 4, count))
        self.weights = _single(rule.weights)
        front = space.boundary_nodes("front")
        self.front = _single(space.nodes[front])
        self.on_front = _single(self.vectors[:, front].transpose(1, 2, 0))
        self.one, self.other = torch.tensor(modes.pairs.T)
        halves = np.where(modes.pairs[:, 0] == modes.pairs[:, 1], 0.5, 1.0)
        self.product = _single(halves * modes.sizes)
        sizes = (20, width, width, width, count)
        layers: list[Any] = []
        for inner, outer in pairwise(sizes):
            layers += [torch.nn.Linear(inner, outer), torch.nn.GELU()]
        self.layers = torch.nn.Sequential(*layers[:-1])
        with torch.no_grad():
            for values in layers[-2].parameters():
                values *= 0.01

    def forward(self, inputs: torch.Tensor, share: torch.Tensor) -> torch.Tensor:
        """Amplitudes and corrections, shape (n, r)."""
        waves = inputs[:, :1] * torch.arange(1, 9) * math.pi
        found: torch.Tensor = self.layers(torch.cat([inputs, torch.sin(waves), torch.cos(waves)], 1))
        return share[:, None] * found

    def coefficients(self, found: torch.Tensor) -> torch.Tensor:
        """Factors of `vectors`, shape (n, r)."""
        free = found[:, :VIBRATIONS]
        products = self.product * free[:, self.one] * free[:, self.other]
        return torch.cat([free, found[:, VIBRATIONS:] + products], 1)

    def pulled_back(self, found: torch.Tensor, slope: torch.Tensor) -> torch.Tensor:
        """The derivative by amplitudes and corrections from that by the factors."""
        slope = slope.clone()
        by_product = slope[:, VIBRATIONS:] * self.product
        slope.index_add_(1, self.one, by_product * found[:, self.other])
        slope.index_add_(1, self.other, by_product * found[:, self.one])
        return slope

    def energy(
        self,
        factors: torch.Tensor,
        centre: torch.Tensor,
        radius: torch.Tensor,
        cells: torch.Tensor | None = None,
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Energy of n states, N mm/mm, and its derivative by the factors, from a part of the triangles."""
        gradients, weights, lame = self.gradients, self.weights, self.lame
        if cells is not None:
            rows = (cells[:, None] * 3 + torch.arange(3)).ravel()
            gradients, weights = gradients[rows], weights[rows] * (len(self.weights) / len(rows))
        count = len(factors)
        flat = gradients.reshape(-1, gradients.shape[-1])
        deformed = (flat @ factors.T).reshape(-1, 4, count) + torch.tensor([1.0, 0, 0, 1])[None, :, None]
        volume = (deformed[:, 0] * deformed[:, 3] - deformed[:, 1] * deformed[:, 2]).clamp(min=0.2)
        log = torch.log(volume)
        cofactor = torch.stack([deformed[:, 3], -deformed[:, 2], -deformed[:, 1], deformed[:, 0]], 1)
        inverse = cofactor / volume[:, None]
        stress = lame.μ * (deformed - inverse) + (lame.λ * log)[:, None] * inverse
        slope = (stress * weights[:, None, None]).reshape(-1, count).T @ flat
        density = lame.μ * (0.5 * (deformed**2).sum(1) - 1 - log) + 0.5 * lame.λ * log * log
        away = self.front + torch.einsum("mir,nr->nmi", self.on_front, factors) - centre[:, None]
        distance = away.norm(dim=-1)
        push = (PENALTY * (radius[:, None] - distance)).clamp(min=0)
        normal = push[..., None] * away / distance[..., None]
        slope = slope - normal.reshape(count, -1) @ self.on_front.reshape(-1, factors.shape[1])
        return (density * weights[:, None]).sum(0) + 0.5 * (push**2).sum(1) / PENALTY, slope


def trained(space: LagrangeSpace, lame: Lame, stroke: float, minutes: float, width: int = 256) -> Family:
    """The network after so many minutes."""
    torch.manual_seed(0)
    generator, family = np.random.default_rng(0), Family(space, lame, width)
    optimiser = torch.optim.Adam(family.parameters(), lr=RATE, betas=(0.9, 0.99))
    start, triangles = time.perf_counter(), len(space.mesh.triangles)
    step = 0
    while (done := (time.perf_counter() - start) / 60 / minutes) < 1:
        cooling = 1.0 if done < 0.3 else 0.5 * (1 + math.cos(math.pi * (done - 0.3) / 0.7))
        optimiser.param_groups[0]["lr"] = RATE * min(1.0, (step + 1) / 100) * max(cooling, 1e-3)
        loads = Loads.drawn(generator, BATCH, min(1.0, 0.1 + 6 * done))
        inputs, centre, radius, share = loads.tensors(stroke)
        found = family(inputs, share)
        cells = torch.tensor(generator.choice(triangles, triangles // PART, replace=False))
        with torch.no_grad():
            _, slope = family.energy(family.coefficients(found), centre, radius, cells)
            slope = family.pulled_back(found, slope) / (share**2 + 0.01)[:, None]
            slope *= (LARGEST / slope.norm(dim=1).clamp(min=LARGEST))[:, None] / BATCH
        optimiser.zero_grad()
        found.backward(slope)
        optimiser.step()
        step += 1
    return family


def answers(family: Family, loads: Loads, stroke: float) -> tuple[FloatArray, FloatArray]:
    """Displacements (n, N, 2), mm, and forces along the stroke, N/mm, by the energy's derivative by it."""
    change, energies = 0.01, []
    with torch.no_grad():
        for step in (change, -change, 0.0):
            moved = Loads(loads.place, loads.radius, loads.direction, loads.share + step)
            inputs, centre, radius, share = moved.tensors(stroke)
            factors = family.coefficients(family(inputs, share))
            energies.append(family.energy(factors, centre, radius)[0].numpy())
    forces = (energies[0] - energies[1]) / (2 * change * stroke)
    return np.tensordot(factors.numpy(), family.vectors, 1), forces


def _single(values: FloatArray) -> torch.Tensor:
    return torch.tensor(values, dtype=torch.float32)

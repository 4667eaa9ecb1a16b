"""The loss: its terms, with their gradients in the parameters, summed over threads and processes.

Terms of one name are added and have one factor in the loss. `add` returns the contribution of some rows of a
term's points and adds factor times its gradient in the parameters in logistic form to `sums`.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import torch
import torch.distributed

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.elasticity import Lame, stress_of
from pinnray.solvers.pinn.paper.mlp_passes import MlpPass
from pinnray.solvers.pinn.paper.modified_mlp import ModifiedMlp, Weights
from pinnray.solvers.pinn.threading import map_in_threads, slices


@dataclass(frozen=True, eq=False)
class EnergyTerm:
    """The mean strain energy density, MPa: the paper's L_PDE, with no external work."""

    points: torch.Tensor  # Shape (n, 2), mm
    weights: torch.Tensor  # Of the points in the mean, shape (n,)
    stiffness: torch.Tensor  # Matrix from (du/dx, du/dy, dv/dx, dv/dy) to stress, shape (4, 4), MPa
    name: str = "PDE"  # Of the term
    divisible: bool = True  # Points can be evaluated in chunks

    def add(self, networks: MlpPass, rows: slice, factor: float, sums: Weights) -> float:
        """Half of stress times displacement gradient; its derivative by that gradient is the stress."""
        gradient = networks.input_gradients().transpose(0, 1).flatten(1)
        stress = (gradient @ self.stiffness).mul_(self.weights[rows, None])
        networks.backward_input_gradients((factor * stress).unflatten(1, (2, 2)).transpose(0, 1), sums)
        return 0.5 * float((stress * gradient).sum())


@dataclass(frozen=True, eq=False)
class DisplacementTerm:
    """The paper's L_BC or L_ASM: weighted squares of differences from given displacements, mm²."""

    name: str  # "BC" or "ASM"
    points: torch.Tensor  # Shape (n, 2), mm
    targets: torch.Tensor  # Prescribed displacements, shape (2, m), mm; m = n without a functional
    weights: torch.Tensor  # Shape (2, m); zero where a component is free
    # Linear functional of the displacement that is prescribed, shape (m, n)
    functional: torch.Tensor | None = None

    @property
    def divisible(self) -> bool:
        """False with a functional, which couples the points."""
        return self.functional is None

    def add(self, networks: MlpPass, rows: slice, factor: float, sums: Weights) -> float:
        """Weighted squares of the differences."""
        values = networks.values()
        if self.functional is None:
            difference = values - self.targets[:, rows]
            weighted = self.weights[:, rows] * difference
            factors = weighted
        else:
            difference = values @ self.functional.T - self.targets
            weighted = self.weights * difference
            factors = weighted @ self.functional
        networks.backward_values(2 * factor * factors, sums)
        return float((weighted * difference).sum())


LossTerm = EnergyTerm | DisplacementTerm


def stiffness_matrix(lame: Lame) -> FloatArray:
    """Hooke's law as a matrix on (du/dx, du/dy, dv/dx, dv/dy), shape (4, 4), MPa; it is symmetric."""
    return stress_of("linear", np.eye(4).reshape(4, 2, 2), lame)[0].reshape(4, 4)


@dataclass(frozen=True)
class ProcessGroup:
    """One of several processes of torchrun, which share a training's points and sum their gradients."""

    rank: int  # Its number; 0 reports and writes
    count: int  # Number of processes

    @classmethod
    def from_environment(cls) -> "ProcessGroup":
        """The processes of torchrun (RANK, WORLD_SIZE), connected by Gloo, or this one alone."""
        count = int(os.environ.get("WORLD_SIZE", "1"))
        if count == 1:
            return ONE_PROCESS
        if not torch.distributed.is_initialized():
            torch.distributed.init_process_group("gloo")
        return cls(torch.distributed.get_rank(), count)

    def sum(self, *tensors: torch.Tensor) -> None:
        """Replace tensors by their sums over all processes."""
        if self.count > 1:
            for tensor in tensors:
                torch.distributed.all_reduce(tensor)


ONE_PROCESS = ProcessGroup(0, 1)

LANES = 16
"""Fixed groups in which chunks are summed, so that rounding is independent of the number of threads."""

CHUNK = 384
"""Points in a chunk."""

Chunk = tuple[LossTerm, slice]


class LossEvaluation(NamedTuple):
    """The loss at some parameters."""

    terms: dict[str, float]  # Value of every term, without its factor
    total: float  # Sum of factor times term
    gradient: torch.Tensor  # Of the total, shape (networks, parameters)


@dataclass(frozen=True, eq=False)
class Loss:
    """A weighted sum of terms."""

    network: ModifiedMlp  # The networks
    terms: Sequence[LossTerm]  # The terms
    factors: Mapping[str, float]  # Weight of the terms by their names
    processes: ProcessGroup = ONE_PROCESS  # Processes that share the chunks

    def __call__(self, parameters: torch.Tensor) -> LossEvaluation:
        """The loss and its gradient at parameters of shape (networks, parameters)."""
        weights = self.network.weights(self.network.in_logistic_form(parameters))

        def lane(chunks: list[Chunk]) -> tuple[dict[str, float], torch.Tensor]:
            values = dict.fromkeys(self.factors, 0.0)
            gradient = torch.zeros_like(parameters)
            sums = self.network.weights(gradient)
            for term, rows in chunks:
                networks = MlpPass(self.network, weights, term.points[rows])
                values[term.name] += term.add(networks, rows, self.factors[term.name], sums)
            return values, gradient

        values = torch.zeros(len(self.factors), dtype=torch.float64)
        gradient = torch.zeros_like(parameters)
        for of_lane, gradient_of_lane in map_in_threads(lane, self._lanes):
            values += torch.tensor(list(of_lane.values()), dtype=torch.float64)
            gradient += gradient_of_lane
        self.processes.sum(values, gradient)
        terms = dict(zip(self.factors, values.tolist(), strict=True))
        total = sum(self.factors[name] * value for name, value in terms.items())
        return LossEvaluation(terms, total, self.network.in_logistic_form(gradient))

    @cached_property
    def _lanes(self) -> list[list[Chunk]]:
        """The chunks of this process, in groups; one chunk a term on a GPU."""
        chunks: list[Chunk] = []
        for term in self.terms:
            count = len(term.points)
            size = CHUNK if term.divisible and not term.points.is_cuda else count
            chunks += [(term, rows) for rows in slices(count, size)]
        lanes = [chunks[start::LANES] for start in range(min(LANES, len(chunks)))]
        return lanes[self.processes.rank :: self.processes.count]

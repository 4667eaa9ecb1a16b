"""The loss and its gradient in the parameters, by chunks of points on several threads and processes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import torch

from solvers.pinn.paper.distributed import ONE_PROCESS, ProcessGroup
from solvers.pinn.paper.loss_terms import LossTerm
from solvers.pinn.paper.mlp_passes import MlpPass
from solvers.pinn.paper.modified_mlp import ModifiedMlp
from solvers.pinn.threading import map_in_threads, slices

LANES = 16
"""Fixed groups in which chunks are summed, so that rounding is independent of the number of threads."""

CHUNK = 384
"""Points in a chunk."""

Chunk = tuple[LossTerm, slice]


class LossEvaluation(NamedTuple):
    """The loss at some parameters.

    Attributes:
        terms: Value of every term, without its factor.
        total: Sum of factor times term.
        gradient: Of the total, shape (networks, parameters).
    """

    terms: dict[str, float]
    total: float
    gradient: torch.Tensor


@dataclass(frozen=True, eq=False)
class Loss:
    """A weighted sum of terms.

    Attributes:
        network: The networks.
        terms: The terms.
        factors: Weight of the terms by their names.
        processes: Processes that share the chunks.
    """

    network: ModifiedMlp
    terms: Sequence[LossTerm]
    factors: Mapping[str, float]
    processes: ProcessGroup = ONE_PROCESS

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

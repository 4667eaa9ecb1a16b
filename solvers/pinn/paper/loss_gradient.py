"""The loss and its derivatives over the parameters, in pieces of points, on several threads and processes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import torch

from solvers.pinn.paper.losses import LossTerm
from solvers.pinn.paper.mlp_passes import MlpPass
from solvers.pinn.paper.modified_mlp import ModifiedMlp
from solvers.pinn.paper.processes import ONE_PROCESS, Processes
from solvers.pinn.threading import cut, in_threads

LANES = 16
"""Pieces are summed in so many fixed groups, so that rounding does not depend on the threads."""

PIECE = 384
"""Points in a piece."""

Piece = tuple[LossTerm, slice]


class Evaluation(NamedTuple):
    """The loss at some parameters.

    Attributes:
        terms: Value of every term, without its factor.
        total: Sum of factor times term.
        gradient: Derivatives of the total, shape (networks, parameters).
    """

    terms: dict[str, float]
    total: float
    gradient: torch.Tensor


@dataclass(frozen=True, eq=False)
class Loss:
    """A weighted sum of terms.

    Attributes:
        network: The networks.
        terms: What is summed.
        factors: Weight of the terms by their names.
        processes: Who share the pieces.
    """

    network: ModifiedMlp
    terms: Sequence[LossTerm]
    factors: Mapping[str, float]
    processes: Processes = ONE_PROCESS

    def __call__(self, parameters: torch.Tensor) -> Evaluation:
        """The loss and its gradient at parameters of shape (networks, parameters)."""
        weights = self.network.weights(self.network.in_logistic_form(parameters))

        def lane(pieces: list[Piece]) -> tuple[dict[str, float], torch.Tensor]:
            values = dict.fromkeys(self.factors, 0.0)
            gradient = torch.zeros_like(parameters)
            sums = self.network.weights(gradient)
            for term, rows in pieces:
                networks = MlpPass(self.network, weights, term.points[rows])
                values[term.name] += term.add(networks, rows, self.factors[term.name], sums)
            return values, gradient

        values = torch.zeros(len(self.factors), dtype=torch.float64)
        gradient = torch.zeros_like(parameters)
        for of_lane, gradient_of_lane in in_threads(lane, self._lanes):
            values += torch.tensor(list(of_lane.values()), dtype=torch.float64)
            gradient += gradient_of_lane
        self.processes.sum(values, gradient)
        terms = dict(zip(self.factors, values.tolist(), strict=True))
        total = sum(self.factors[name] * value for name, value in terms.items())
        return Evaluation(terms, total, self.network.in_logistic_form(gradient))

    @cached_property
    def _lanes(self) -> list[list[Piece]]:
        """The pieces of this process, in groups; one piece a term on a GPU."""
        pieces: list[Piece] = []
        for term in self.terms:
            count = len(term.points)
            size = PIECE if term.divisible and not term.points.is_cuda else count
            pieces += [(term, rows) for rows in cut(count, size)]
        lanes = [pieces[start::LANES] for start in range(min(LANES, len(pieces)))]
        return lanes[self.processes.rank :: self.processes.count]

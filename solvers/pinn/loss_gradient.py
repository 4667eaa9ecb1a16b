"""The loss and its gradient over the parameters, term by term, in pieces of points and in several threads."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import torch

from solvers.pinn.losses import LossTerm
from solvers.pinn.modified_mlp import ModifiedMlp
from solvers.pinn.pieces import cut, in_threads

LANES = 16
"""Pieces are summed in so many fixed groups, so that rounding does not depend on the threads."""

PIECE = 256
"""Points in a piece."""


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
    """

    network: ModifiedMlp
    terms: Sequence[LossTerm]
    factors: Mapping[str, float]

    @cached_property
    def _lanes(self) -> list[list[tuple[LossTerm, slice]]]:
        pieces = []
        for term in self.terms:
            whole = not term.divisible or term.points.is_cuda
            count = len(term.points)
            pieces += [(term, rows) for rows in cut(count, count if whole else PIECE)]
        return [pieces[start::LANES] for start in range(min(LANES, len(pieces)))]

    def __call__(self, parameters: torch.Tensor) -> Evaluation:
        """The loss and its gradient at parameters of shape (networks, parameters)."""

        def lane(pieces: list[tuple[LossTerm, slice]]) -> tuple[dict[str, float], torch.Tensor]:
            sums = dict.fromkeys(self.factors, 0.0)
            gradient = torch.zeros_like(parameters)
            for term, rows in pieces:
                layers = self.network.forward(parameters, term.points[rows], derivatives=term.derivatives)
                share = term.share(layers.output, rows)
                sums[term.name] += float(share.value)
                self.network.reverse(parameters, layers, self.factors[term.name] * share.adjoint, gradient)
            return sums, gradient

        results = in_threads(lane, self._lanes)
        terms = {name: sum(sums[name] for sums, _ in results) for name in self.factors}
        gradient = results[0][1]
        for _, other in results[1:]:
            gradient += other
        return Evaluation(terms, sum(self.factors[name] * value for name, value in terms.items()), gradient)

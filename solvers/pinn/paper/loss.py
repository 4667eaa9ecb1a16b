"""The loss: its terms, and their sum with its gradient in the parameters, in chunks over threads.

Terms of one name are added and have one factor in the loss.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import torch

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.elasticity import Lame, stress_of
from pinnray.solvers.pinn.paper.modified_mlp import ModifiedMlp
from pinnray.solvers.pinn.threading import imap_in_threads, slices


@dataclass(frozen=True, eq=False)
class EnergyTerm:
    """The mean strain energy density, MPa: the paper's L_PDE, with no external work."""

    points: torch.Tensor  # Shape (n, 2), mm
    weights: torch.Tensor  # Of the points in the mean, shape (n,)
    stiffness: torch.Tensor  # Matrix from (du/dx, du/dy, dv/dx, dv/dy) to stress, shape (4, 4), MPa
    name: str = "PDE"  # Of the term
    divisible: bool = True  # Points can be evaluated in chunks

    def value(self, network: ModifiedMlp, parameters: torch.Tensor, rows: slice) -> torch.Tensor:
        """The part of some rows of the points: half of stress times displacement gradient."""
        gradient = network.gradients(parameters, self.points[rows]).transpose(0, 1).flatten(1)
        return 0.5 * self.weights[rows] @ ((gradient @ self.stiffness) * gradient).sum(dim=1)


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

    def value(self, network: ModifiedMlp, parameters: torch.Tensor, rows: slice) -> torch.Tensor:
        """The part of some rows of the points; of all with a functional."""
        values = network.values(parameters, self.points[rows])
        if self.functional is not None:
            values, rows = values @ self.functional.T, slice(None)
        return (self.weights[:, rows] * (values - self.targets[:, rows]).square()).sum()


LossTerm = EnergyTerm | DisplacementTerm


def stiffness_matrix(lame: Lame) -> FloatArray:
    """Hooke's law as a matrix on (du/dx, du/dy, dv/dx, dv/dy), shape (4, 4), MPa; it is symmetric."""
    return stress_of("linear", np.eye(4).reshape(4, 2, 2), lame)[0].reshape(4, 4)


CHUNK = 384
"""Points in a chunk."""

Chunk = tuple[LossTerm, slice]


class LossEvaluation(NamedTuple):
    """The loss at some parameters, on their device: nothing is read back."""

    values: (
        torch.Tensor
    )  # Value of every term, without its factor, and the total, in double precision, (k + 1,)
    gradient: torch.Tensor  # Of the total, shape (networks, parameters)


@dataclass(frozen=True, eq=False)
class Loss:
    """A weighted sum of terms."""

    network: ModifiedMlp  # The networks
    terms: Sequence[LossTerm]  # The terms
    factors: Mapping[str, float]  # Weight of the terms by their names

    def __call__(self, parameters: torch.Tensor) -> LossEvaluation:
        """The loss and its gradient at parameters of shape (networks, parameters).

        Chunks are added in their order, so that rounding is independent of the number of threads.
        """

        def part(chunk: Chunk) -> tuple[str, torch.Tensor, torch.Tensor]:
            term, rows = chunk
            own = parameters.detach().requires_grad_()
            value = term.value(self.network, own, rows)
            (slope,) = torch.autograd.grad(self.factors[term.name] * value, own)
            return term.name, value.detach().double(), slope

        # A GPU's work is captured where it is launched, which other threads do not.
        parts = map(part, self._chunks) if parameters.is_cuda else imap_in_threads(part, self._chunks)
        terms = {name: parameters.new_zeros((), dtype=torch.float64) for name in self.factors}
        gradient = torch.zeros_like(parameters)
        for name, value, slope in parts:
            terms[name] += value
            gradient += slope
        total = torch.stack([self.factors[name] * value for name, value in terms.items()]).sum()
        return LossEvaluation(torch.stack([*terms.values(), total]), gradient)

    @cached_property
    def _chunks(self) -> list[Chunk]:
        """The terms in chunks; one chunk a term on a GPU."""
        chunks: list[Chunk] = []
        for term in self.terms:
            count = len(term.points)
            size = CHUNK if term.divisible and not term.points.is_cuda else count
            chunks += [(term, rows) for rows in slices(count, size)]
        return chunks

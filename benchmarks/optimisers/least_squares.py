"""Arguments and results of the optimisers for sums of squares."""

from typing import NamedTuple, Protocol

import torch


class Residuals(Protocol):
    """Functions r of n parameters, whose |r|² / 2 is minimised."""

    def values(self, parameters: torch.Tensor) -> torch.Tensor:
        """Residuals at parameters of shape (n,): shape (m,)."""
        ...

    def linearised(self, parameters: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Residuals, shape (m,), and their Jacobian, shape (m, n)."""
        ...


class Iterate(NamedTuple):
    """State of an optimiser.

    Attributes:
        parameters: Shape (n,).
        value: The objective there.
    """

    parameters: torch.Tensor
    value: float


def half_square(residuals: torch.Tensor) -> float:
    """|r|² / 2."""
    return 0.5 * float(residuals @ residuals)

"""The terms of the loss and the derivatives of each along the network's output."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import torch

from geometry.arrays import FloatArray
from solvers.elasticity import Lame, linear_stress


class Share(NamedTuple):
    """What some points contribute to a term.

    Attributes:
        value: Scalar.
        adjoint: Its derivatives along the network's output, shape (2, streams, n).
    """

    value: torch.Tensor
    adjoint: torch.Tensor


class LossTerm(Protocol):
    """A sum over points of something that the network's output determines there."""

    @property
    def name(self) -> str:
        """Terms of one name are added and weighted together."""
        ...

    @property
    def points(self) -> torch.Tensor:
        """Shape (n, 2), mm."""
        ...

    @property
    def derivatives(self) -> bool:
        """Whether it needs the displacement gradient."""
        ...

    @property
    def divisible(self) -> bool:
        """Whether its points can be evaluated in pieces."""
        ...

    def share(self, output: torch.Tensor, rows: slice) -> Share:
        """What the points `rows` contribute, given the network's output there, shape (2, streams, n)."""
        ...


@dataclass(frozen=True, eq=False)
class EnergyTerm:
    """The mean strain energy density, MPa: the paper's L_PDE, with no external work.

    Attributes:
        points: Shape (n, 2), mm.
        shares: Share of each point in the mean, shape (n,).
        stiffness: What multiplies (du/dx, du/dy, dv/dx, dv/dy) to give the stress, shape (4, 4), MPa.
    """

    points: torch.Tensor
    shares: torch.Tensor
    stiffness: torch.Tensor
    name: str = "PDE"
    derivatives: bool = True
    divisible: bool = True

    def share(self, output: torch.Tensor, rows: slice) -> Share:
        """Half of stress times gradient; the stress is its derivative."""
        gradient = output[:, 1:].flatten(0, 1)
        stress = (self.stiffness @ gradient).mul_(self.shares[rows])
        adjoint = torch.zeros_like(output)
        adjoint[:, 1:] = stress.view(2, 2, -1)
        return Share(0.5 * (stress * gradient).sum(), adjoint)


@dataclass(frozen=True, eq=False)
class DisplacementTerm:
    """A weighted sum of squared differences from prescribed displacements, mm²: the paper's L_BC and L_ASM.

    Attributes:
        name: "BC" or "ASM".
        points: Shape (n, 2), mm.
        targets: Prescribed displacements, shape (2, m), mm; m = n without a functional.
        weights: Shape (2, m); zero where a component is free.
        functional: What is prescribed is this linear functional of the displacement, shape (m, n).
    """

    name: str
    points: torch.Tensor
    targets: torch.Tensor
    weights: torch.Tensor
    functional: torch.Tensor | None = None
    derivatives: bool = False

    @property
    def divisible(self) -> bool:
        """Whether every point counts for itself."""
        return self.functional is None

    def share(self, output: torch.Tensor, rows: slice) -> Share:
        """Weighted squares of the differences."""
        values = output[:, 0]
        if self.functional is None:
            difference = values - self.targets[:, rows]
            weighted = self.weights[:, rows] * difference
            adjoint = 2 * weighted
        else:
            difference = values @ self.functional.T - self.targets
            weighted = self.weights * difference
            adjoint = 2 * weighted @ self.functional
        return Share((weighted * difference).sum(), adjoint[:, None])


def stiffness_matrix(lame: Lame) -> FloatArray:
    """`linear_stress` as a matrix on (du/dx, du/dy, dv/dx, dv/dy), shape (4, 4), MPa."""
    stress = linear_stress(np.eye(4).reshape(4, 2, 2), lame)
    return np.stack([stress.xx, stress.xy, stress.xy, stress.yy])

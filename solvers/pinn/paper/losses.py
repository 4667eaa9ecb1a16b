"""The terms of the loss: what they add to it, and to its derivatives over the parameters."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import torch

from geometry.arrays import FloatArray
from solvers.elasticity import Lame, linear_stress
from solvers.pinn.paper.mlp_passes import MlpPass
from solvers.pinn.paper.modified_mlp import Weights


class LossTerm(Protocol):
    """A sum over points of something that two networks, for u and v, determine there."""

    @property
    def name(self) -> str:
        """Terms of one name are added and have one factor in the loss."""
        ...

    @property
    def points(self) -> torch.Tensor:
        """Shape (n, 2), mm."""
        ...

    @property
    def divisible(self) -> bool:
        """Whether its points can be evaluated in pieces."""
        ...

    def add(self, networks: MlpPass, rows: slice, factor: float, sums: Weights) -> float:
        """What the points `rows` contribute; factor times its derivatives are added to `sums`.

        Args:
            networks: Both networks at these points.
            rows: Which of the points they are.
            factor: Of the term in the loss.
            sums: Derivatives over the parameters in logistic form.
        """
        ...


@dataclass(frozen=True, eq=False)
class EnergyTerm:
    """The mean strain energy density, MPa: the paper's L_PDE, with no external work.

    Attributes:
        points: Shape (n, 2), mm.
        shares: Share of each point in the mean, shape (n,).
        stiffness: What multiplies (du/dx, du/dy, dv/dx, dv/dy) to give the stress, shape (4, 4), MPa.
        name: Of the term.
        divisible: Points can be evaluated in pieces.
    """

    points: torch.Tensor
    shares: torch.Tensor
    stiffness: torch.Tensor
    name: str = "PDE"
    divisible: bool = True

    def add(self, networks: MlpPass, rows: slice, factor: float, sums: Weights) -> float:
        """Half of stress times displacement gradient, whose derivative along that gradient is the stress."""
        gradient = networks.slopes().transpose(0, 1).flatten(1)
        stress = (gradient @ self.stiffness).mul_(self.shares[rows, None])
        networks.add_slope_gradient((factor * stress).unflatten(1, (2, 2)).transpose(0, 1), sums)
        return 0.5 * float((stress * gradient).sum())


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

    @property
    def divisible(self) -> bool:
        """Whether every point counts for itself."""
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
        networks.add_value_gradient(2 * factor * factors, sums)
        return float((weighted * difference).sum())


def stiffness_matrix(lame: Lame) -> FloatArray:
    """`linear_stress` as a matrix on (du/dx, du/dy, dv/dx, dv/dy), shape (4, 4), MPa; it is symmetric."""
    stress = linear_stress(np.eye(4).reshape(4, 2, 2), lame)
    return np.stack([stress.xx, stress.xy, stress.xy, stress.yy], axis=1)

"""Terms of the loss, with their gradients in the networks' parameters.

Terms of one name are added and have one factor in the loss. `add` returns the contribution of some rows of a
term's points and adds factor times its gradient in the parameters in logistic form to `sums`.
"""

from dataclasses import dataclass

import numpy as np
import torch

from geometry.arrays import FloatArray
from solvers.elasticity import Lame, linear_stress
from solvers.pinn.paper.mlp_passes import MlpPass
from solvers.pinn.paper.modified_mlp import Weights


@dataclass(frozen=True, eq=False)
class EnergyTerm:
    """The mean strain energy density, MPa: the paper's L_PDE, with no external work.

    Attributes:
        points: Shape (n, 2), mm.
        weights: Of the points in the mean, shape (n,).
        stiffness: Matrix from (du/dx, du/dy, dv/dx, dv/dy) to stress, shape (4, 4), MPa.
        name: Of the term.
        divisible: Points can be evaluated in chunks.
    """

    points: torch.Tensor
    weights: torch.Tensor
    stiffness: torch.Tensor
    name: str = "PDE"
    divisible: bool = True

    def add(self, networks: MlpPass, rows: slice, factor: float, sums: Weights) -> float:
        """Half of stress times displacement gradient; its derivative by that gradient is the stress."""
        gradient = networks.input_gradients().transpose(0, 1).flatten(1)
        stress = (gradient @ self.stiffness).mul_(self.weights[rows, None])
        networks.backward_input_gradients((factor * stress).unflatten(1, (2, 2)).transpose(0, 1), sums)
        return 0.5 * float((stress * gradient).sum())


@dataclass(frozen=True, eq=False)
class DisplacementTerm:
    """A weighted sum of squared differences from prescribed displacements, mm²: the paper's L_BC and L_ASM.

    Attributes:
        name: "BC" or "ASM".
        points: Shape (n, 2), mm.
        targets: Prescribed displacements, shape (2, m), mm; m = n without a functional.
        weights: Shape (2, m); zero where a component is free.
        functional: Linear functional of the displacement that is prescribed, shape (m, n).
    """

    name: str
    points: torch.Tensor
    targets: torch.Tensor
    weights: torch.Tensor
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
    """`linear_stress` as a matrix on (du/dx, du/dy, dv/dx, dv/dy), shape (4, 4), MPa; it is symmetric."""
    stress = linear_stress(np.eye(4).reshape(4, 2, 2), lame)
    return np.stack([stress.xx, stress.xy, stress.xy, stress.yy], axis=1)

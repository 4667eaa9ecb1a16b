"""`pinn-local`: Shepard's windows over random tanh neurons, the output layer solved exactly."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import torch

from geometry.arrays import FloatArray
from geometry.errors import UserError
from solvers.pinn.finite_basis.shepard_windows import ShepardWindows
from solvers.pinn.finite_basis.solver import FiniteBasisSolver


@dataclass(frozen=True, kw_only=True)
class PinnLocalSolver(FiniteBasisSolver):
    """A finite-basis network with random hidden weights, whose output layer alone is solved for, exactly.

    Its windows are round and normalised to sum to one. The rest is as in `FiniteBasisSolver`.

    Attributes:
        radius: Radius of a window in spacings.
    """

    wall_spacing: float = 0.5
    corner_spacing: float = 0.006
    growth: float = 0.5
    radius: float = 1.8
    steepness: float = 0.4
    cell: float = 0.45
    name: ClassVar[str] = "pinn-local"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.radius < 1.2:
            raise UserError(f"pinn-local: windows overlap from a radius of 1.2 on, got {self.radius}")

    def windows(self, centres: FloatArray, spacing: FloatArray, rng: np.random.Generator) -> ShepardWindows:
        """A round window for every centre; see `FiniteBasisSolver`."""
        return ShepardWindows(torch.from_numpy(centres), torch.from_numpy(self.radius * spacing))

"""`pinn-std` and `pinn-local`: gates or Shepard's windows over random tanh neurons, output solved exactly."""

from dataclasses import asdict, dataclass
from typing import ClassVar

import numpy as np
import torch

from geometry.arrays import FloatArray
from geometry.errors import UserError
from solvers.pinn.finite_basis.gate_tree import GateTree
from solvers.pinn.finite_basis.shepard_windows import ShepardWindows
from solvers.pinn.finite_basis.solver import FiniteBasisSolver


@dataclass(frozen=True, kw_only=True)
class PinnStdSolver(FiniteBasisSolver):
    """A gated network with random hidden weights, whose output layer alone is solved for, exactly.

    This is the preset `fast`; the preset `paper`, `PaperPinnSolver`, trains all weights as the paper does. A
    gated layer of the paper's network mixes two encoders; here the gate above mixes its result again, and so
    on (`GateTree`), so that every encoder serves a part of the body. An encoder is a hidden layer of tanh
    neurons with its own output weights. The rest is as in `FiniteBasisSolver`.

    Attributes:
        gate_width: Width of the gates in spacings.
    """

    wall_spacing: float = 0.8
    corner_spacing: float = 0.02
    growth: float = 0.55
    gate_width: float = 1.0
    steepness: float = 0.5
    cell: float = 0.5
    name: ClassVar[str] = "pinn-std"

    def settings(self) -> dict[str, object]:
        """The preset and the settings of `FiniteBasisSolver`."""
        return {"preset": "fast", **asdict(self)}

    def windows(self, centres: FloatArray, spacing: FloatArray, rng: np.random.Generator) -> GateTree:
        """Gates with an encoder for every centre; see `FiniteBasisSolver`."""
        return GateTree.over(centres, spacing, width=self.gate_width, rng=rng)


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

"""`pinn-std`, preset `fast`: a gated network with random hidden weights, its output layer solved exactly."""

from dataclasses import asdict, dataclass
from typing import ClassVar

import numpy as np

from geometry.arrays import FloatArray
from solvers.pinn.finite_basis.gate_tree import GateTree
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

"""`pinn-std`: the paper's gated architecture, its gates a tree, its output layer solved exactly."""

from dataclasses import asdict, dataclass
from typing import ClassVar

import numpy as np

from geometry.arrays import FloatArray
from solvers.pinn.finite_basis.gate_tree import GateTree
from solvers.pinn.finite_basis.solver import FiniteBasisSolver


@dataclass(frozen=True, kw_only=True)
class PinnStdSolver(FiniteBasisSolver):
    """A gated network: sigmoid gates of the input that mix, layer by layer, what encoders of the input give.

    The gated layer of the paper's network mixes two encoders. Here its result is mixed again by the gate
    above it, and so on (`GateTree`), so that every encoder serves a part of the body of its own; an encoder
    is a hidden layer of tanh neurons with its own output weights. The rest is as in `FiniteBasisSolver`.

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
        """The preset that this is, and the settings of `FiniteBasisSolver`."""
        return {"preset": "fast", **asdict(self)}

    def windows(self, centres: FloatArray, spacing: FloatArray, rng: np.random.Generator) -> GateTree:
        """Gates with an encoder for every centre; see `FiniteBasisSolver`."""
        return GateTree.over(centres, spacing, width=self.gate_width, rng=rng)

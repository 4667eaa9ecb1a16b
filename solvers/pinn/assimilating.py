"""`pinn-asm` and `pinn-local-asm`: the networks of `pinn-std` and `pinn-local`, given the markers."""

from dataclasses import dataclass
from typing import ClassVar

from solvers.pinn.local import PinnLocalSolver
from solvers.pinn.observing import Assimilating
from solvers.pinn.paper import PaperPinnSolver
from solvers.pinn.standard import PinnStdSolver


@dataclass(frozen=True, kw_only=True)
class PinnAsmSolver(Assimilating, PinnStdSolver):
    """The network of `PinnStdSolver`, given the markers."""

    name: ClassVar[str] = "pinn-asm"


@dataclass(frozen=True, kw_only=True)
class PinnLocalAsmSolver(Assimilating, PinnLocalSolver):
    """The network of `PinnLocalSolver`, given the markers."""

    name: ClassVar[str] = "pinn-local-asm"


@dataclass(frozen=True, kw_only=True)
class PaperPinnAsmSolver(Assimilating, PaperPinnSolver):
    """The networks and the training of `PaperPinnSolver`, with the paper's L_ASM in the loss.

    Attributes:
        marker_radius: As in `Assimilating`; the paper takes the displacement of the centre.
    """

    marker_radius: float = 0.0
    name: ClassVar[str] = "pinn-asm"

"""`pinn-asm` and `pinn-local-asm`: the networks of `pinn-std` and `pinn-local` with the markers' misfit."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from geometry.observations import Observations
from solvers.assimilation.marker_weighting import Choice
from solvers.assimilation.misfit import Weighting
from solvers.pinn.finite_basis.local import PinnLocalSolver
from solvers.pinn.finite_basis.refit import network_refitter
from solvers.pinn.finite_basis.standard import PinnStdSolver
from solvers.pinn.paper.solver import PaperPinnSolver
from solvers.problem import Problem
from solvers.solution import Solution


@dataclass(frozen=True, kw_only=True)
class PinnAsmSolver(PinnStdSolver):
    """The network of `PinnStdSolver`, random hidden weights and exact output layer, with the markers' misfit.

    Energy plus misfit is minimised. The settings that are not the network's are those of `MarkerWeighting`.
    """

    weights: Weighting = "paper"
    asm_weight: float = 1000.0
    scale: float = 1.0
    marker_radius: float | None = None
    contact_deviation: float = 0.0
    choose: Choice = "given"
    name: ClassVar[str] = "pinn-asm"
    assimilates: ClassVar[bool] = True

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """See `Refittable`."""
        return network_refitter(self, problem)


@dataclass(frozen=True, kw_only=True)
class PinnLocalAsmSolver(PinnLocalSolver):
    """The network of `PinnLocalSolver` with the markers' misfit, as in `PinnAsmSolver`."""

    weights: Weighting = "paper"
    asm_weight: float = 1000.0
    scale: float = 1.0
    marker_radius: float | None = None
    contact_deviation: float = 0.0
    choose: Choice = "given"
    name: ClassVar[str] = "pinn-local-asm"
    assimilates: ClassVar[bool] = True

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """See `Refittable`."""
        return network_refitter(self, problem)


@dataclass(frozen=True, kw_only=True)
class PaperPinnAsmSolver(PaperPinnSolver):
    """The networks and the training of `PaperPinnSolver`, with the paper's L_ASM in the loss.

    Attributes:
        marker_radius: As in `MarkerWeighting`; the paper takes the displacement of the centre.
    """

    weights: Weighting = "paper"
    asm_weight: float = 1000.0
    scale: float = 1.0
    marker_radius: float | None = 0.0
    name: ClassVar[str] = "pinn-asm"
    assimilates: ClassVar[bool] = True

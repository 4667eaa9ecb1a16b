"""`pinn-asm` and `pinn-local-asm`: the networks of `pinn-std` and `pinn-local`, given the markers."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.observations import Observations
from solvers.pinn.finite_basis.local import PinnLocalSolver
from solvers.pinn.finite_basis.refit import network_refitter
from solvers.pinn.finite_basis.standard import PinnStdSolver
from solvers.pinn.marker_terms import Assimilating, ChoosingWeights
from solvers.pinn.paper.solver import PaperPinnSolver
from solvers.pinn.threading import pool
from solvers.problem import Problem
from solvers.solution import Solution


@dataclass(frozen=True, kw_only=True)
class PinnAsmSolver(ChoosingWeights, PinnStdSolver):
    """The network of `PinnStdSolver`, given the markers."""

    name: ClassVar[str] = "pinn-asm"

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """See `Refittable`."""
        return network_refitter(self, problem)


@dataclass(frozen=True, kw_only=True)
class PinnLocalAsmSolver(ChoosingWeights, PinnLocalSolver):
    """The network of `PinnLocalSolver`, given the markers."""

    name: ClassVar[str] = "pinn-local-asm"

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """See `Refittable`."""
        return network_refitter(self, problem)


@dataclass(frozen=True, kw_only=True)
class PaperPinnAsmSolver(Assimilating, PaperPinnSolver):
    """The networks and the training of `PaperPinnSolver`, with the paper's L_ASM in the loss.

    Attributes:
        marker_radius: As in `Assimilating`; the paper takes the displacement of the centre.
    """

    marker_radius: float | None = 0.0
    name: ClassVar[str] = "pinn-asm"


def l_curve(solver: PinnAsmSolver | PinnLocalAsmSolver, problem: Problem) -> dict[str, FloatArray]:
    """Energy and misfit for all weights, see `WeightChoice.curve`, in the time of one level.

    Raises:
        UserError: If there are no markers that weigh anything, or the law is not linear.
    """
    with pool():
        level = solver.level(problem, 1.0)
        state = level.step(level.rest)
    if state is None or state.markers is None:
        raise UserError(f"{solver.name} has an L-curve for the linear law and markers that it is given")
    return solver.choice.curve(state.markers)

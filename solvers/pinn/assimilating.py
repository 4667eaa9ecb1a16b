"""`pinn-asm` and `pinn-local-asm`: the networks of `pinn-std` and `pinn-local` with the markers' misfit."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

from geometry.observations import Observations
from solvers.assimilation.misfit import MarkerSettings, Weighting
from solvers.pinn.finite_basis.local import PinnLocalSolver
from solvers.pinn.finite_basis.solver import FiniteBasisSolver
from solvers.pinn.finite_basis.standard import PinnStdSolver
from solvers.pinn.paper.solver import PaperPinnSolver
from solvers.problem import Problem
from solvers.shared_work import SharedWork
from solvers.solution import Solution


def network_refitter(solver: FiniteBasisSolver, problem: Problem) -> Callable[[Observations], Solution]:
    """See `Refittable`; one factorisation of each level for all observations if the law is linear."""
    work = SharedWork()

    def refit(observations: Observations) -> Solution:
        with work.used():
            return solver.solve(replace(problem, observations=observations))

    return refit


@dataclass(frozen=True, kw_only=True)
class PinnAsmSolver(MarkerSettings, PinnStdSolver):
    """The network of `PinnStdSolver`, random hidden weights and exact outputs, with the markers' misfit."""

    name: ClassVar[str] = "pinn-asm"
    twin: ClassVar[str] = "fem-asm"
    loads: ClassVar[tuple[str, ...]] = ("mean", "point", "patch")
    refitter = network_refitter


@dataclass(frozen=True, kw_only=True)
class PinnLocalAsmSolver(MarkerSettings, PinnLocalSolver):
    """The network of `PinnLocalSolver` with the markers' misfit, as in `PinnAsmSolver`."""

    name: ClassVar[str] = "pinn-local-asm"
    twin: ClassVar[str] = "fem-asm"
    loads: ClassVar[tuple[str, ...]] = ("mean", "point", "patch")
    refitter = network_refitter


@dataclass(frozen=True, kw_only=True)
class PaperPinnAsmSolver(PaperPinnSolver):
    """The networks and the training of `PaperPinnSolver`, with the paper's L_ASM in the loss.

    Attributes:
        marker_radius: As in `MarkerSettings`; the paper takes the displacement of the centre.
    """

    weights: Weighting = "paper"
    asm_weight: float = 1000.0
    scale: float = 1.0
    marker_radius: float | None = 0.0
    name: ClassVar[str] = "pinn-asm"
    twin: ClassVar[str] = "fem-asm"
    assimilates: ClassVar[bool] = True

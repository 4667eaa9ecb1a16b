"""`pinn-asm` and `pinn-local-asm`: the networks of `pinn-std` and `pinn-local` with the markers' misfit."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from geometry.observations import Observations
from solvers.assimilation.misfit import MarkerSettings, Misfit, Weighting
from solvers.pinn.finite_basis.constrained_network import ConstrainedNetwork, LinearResponse
from solvers.pinn.finite_basis.local import PinnLocalSolver
from solvers.pinn.finite_basis.network import FiniteBasisField
from solvers.pinn.finite_basis.newton import LoadStep
from solvers.pinn.finite_basis.solver import FiniteBasisSolver
from solvers.pinn.finite_basis.standard import PinnStdSolver
from solvers.pinn.paper.solver import PaperPinnSolver
from solvers.pinn.threading import pool
from solvers.problem import Problem
from solvers.solution import Solution
from solvers.solver import Progress, silent


def network_refitter(solver: FiniteBasisSolver, problem: Problem) -> Callable[[Observations], Solution]:
    """See `Refittable`; one factorisation of each level for all observations if the law is linear."""
    kept: dict[float, tuple[ConstrainedNetwork, LinearResponse]] = {}
    factorised: list[Misfit] = []

    def refit(observations: Observations) -> Solution:
        own, every = (
            replace(problem, observations=replace(observations, visible=seen))
            for seen in (observations.visible, np.ones_like(observations.visible))
        )
        misfit, whole = solver.misfit(own), solver.misfit(every)
        if misfit is None or whole is None or problem.material.law != "linear":
            return solver.solve(own)
        factorised[:] = factorised or [whole]
        markers = factorised[0]
        if misfit.radius != markers.radius or not np.array_equal(markers.points, observations.points):
            return solver.solve(own)

        def train(
            scale: float, coarse: FiniteBasisField | None, progress: Progress
        ) -> tuple[ConstrainedNetwork, LoadStep]:
            if scale not in kept:
                network = solver.level(every, scale)
                response = network.linear_response(network.zero_output)
                if response is None:
                    raise ValueError("a linear energy has derivatives everywhere")
                kept[scale] = network, response
            network, response = kept[scale]
            seen = np.concatenate([np.ones(network.load_count, bool), np.repeat(observations.visible, 2)])
            (rows,) = np.nonzero(seen)
            network = network.with_misfit(misfit, rows)
            response = response._replace(unit=response.unit[rows])
            return network, LoadStep(1.0, network.constrained_step(network.zero_output, response), 1)

        with pool():
            return solver.trained(own, train, silent)

    return refit


@dataclass(frozen=True, kw_only=True)
class PinnAsmSolver(MarkerSettings, PinnStdSolver):
    """The network of `PinnStdSolver`, random hidden weights and exact outputs, with the markers' misfit."""

    name: ClassVar[str] = "pinn-asm"
    loads: ClassVar[tuple[str, ...]] = ("mean", "point", "patch")
    refitter = network_refitter


@dataclass(frozen=True, kw_only=True)
class PinnLocalAsmSolver(MarkerSettings, PinnLocalSolver):
    """The network of `PinnLocalSolver` with the markers' misfit, as in `PinnAsmSolver`."""

    name: ClassVar[str] = "pinn-local-asm"
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
    assimilates: ClassVar[bool] = True

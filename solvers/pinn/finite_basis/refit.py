"""Other observations of the same markers, for a finite-basis network whose levels were factorised once."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from geometry.observations import Observations
from solvers.pinn.finite_basis.equilibrium import Level, Responses
from solvers.pinn.finite_basis.network import LocalField
from solvers.pinn.finite_basis.newton import Path
from solvers.pinn.finite_basis.solver import FiniteBasisSolver
from solvers.pinn.threading import pool
from solvers.problem import Problem
from solvers.solution import Solution
from solvers.solver import Progress, silent


def network_refitter(solver: FiniteBasisSolver, problem: Problem) -> Callable[[Observations], Solution]:
    """What solves for other observations; by one factorisation of each level if the law is linear."""
    kept: dict[float, tuple[Level, Responses]] = {}
    first: list[Observations] = []

    def refit(observations: Observations) -> Solution:
        own, every = (
            replace(problem, observations=replace(observations, visible=seen))
            for seen in (observations.visible, np.ones_like(observations.visible))
        )
        given, whole = solver.given(own), solver.given(every)
        first[:] = first or [observations]
        if (
            given is None
            or whole is None
            or problem.material.law != "linear"
            or given.misfit.radius != whole.misfit.radius
            or not np.array_equal(first[0].points, observations.points)
        ):
            return solver.solve(own)

        def train(scale: float, coarse: LocalField | None, progress: Progress) -> tuple[Level, Path]:
            if scale not in kept:
                level = solver.level(every, scale)
                found = level.respond(level.rest)
                if found is None:
                    raise ValueError("a linear energy has derivatives everywhere")
                kept[scale] = level, found
            level, found = kept[scale]
            seen = np.concatenate([np.ones(level.held, dtype=bool), np.repeat(observations.visible, 2)])
            (rows,) = np.nonzero(seen)
            told = level.told(given, rows)
            state = told.balance(told.rest, found._replace(unit=found.unit[rows]))
            return told, Path.start(told).to(1.0, state, 1)

        with pool():
            return solver.trained(own, train, silent)

    return refit

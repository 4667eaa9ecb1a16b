"""Solvers whose claims are false, in a module that processes can import."""

import time
from dataclasses import dataclass, replace

from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.lagrange import LagrangeField
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution, Status
from pinnray.solvers.solver import Progress, silent


@dataclass(frozen=True)
class Scaled:
    """`fem`, its displacement and force times a factor plus a shift, mm, its error estimate times another."""

    factor: float = 1.0
    estimate: float = 1.0
    converged: bool = True
    wait_s: float = 0.0
    shift: float = 0.0
    name = "scaled"
    laws = ("linear",)
    loads = ("mean",)

    def settings(self) -> dict[str, object]:
        return dict(vars(self))

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        time.sleep(self.wait_s)
        if not self.factor:
            raise ZeroDivisionError("no factor")
        found = FemSolver().solve(problem)
        assert isinstance(found.field, LagrangeField)
        field = LagrangeField(found.field.space, self.factor * found.field.values + self.shift)
        error = found.error and replace(found.error, displacement=self.estimate * found.error.displacement)
        return replace(
            found, solver=self.name, field=field, error=error, energy=self.factor**2 * found.energy,
            reaction=self.factor * found.reaction, status=Status(self.converged, "says so"),
        )  # fmt: skip

"""Base of the networks."""

from abc import ABC, abstractmethod
from typing import ClassVar

from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import Family, FieldSettings, Progress, silent


class NetworkSolver(FieldSettings, ABC):
    """A solver by a network; `MarkerWeights` are the settings of one that assimilates."""

    family: ClassVar[Family] = "neural network"
    assimilates: ClassVar[bool] = False
    laws: ClassVar[tuple[str, ...]] = ("linear",)
    loads: ClassVar[tuple[str, ...]] = ("mean", "point")

    @abstractmethod
    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Train on the problem; see `Solver`."""

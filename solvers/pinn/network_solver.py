"""Base of the networks: their settings, and the markers' misfit of those that assimilate."""

from abc import ABC, abstractmethod
from typing import ClassVar

from pinnray.solvers.assimilation.marker_weighting import MarkerWeighting
from pinnray.solvers.assimilation.misfit import Misfit
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import Family, FieldSettings, Progress, silent


class NetworkSolver(FieldSettings, ABC):
    """A solver by a network, whose subclasses may have the fields of `MarkerSettings`."""

    family: ClassVar[Family] = "neural network"
    assimilates: ClassVar[bool] = False
    laws: ClassVar[tuple[str, ...]] = ("linear",)
    loads: ClassVar[tuple[str, ...]] = ("mean", "point")

    @property
    def weighting(self) -> MarkerWeighting | None:
        """The weights of the markers; None for a solver that does not assimilate them."""
        return MarkerWeighting.of(self) if self.assimilates else None

    def misfit(self, problem: Problem) -> Misfit | None:
        """The misfit that is minimised together with the energy, if any; see `MarkerWeighting.misfit`."""
        return None if self.weighting is None else self.weighting.misfit(problem)

    @abstractmethod
    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Train on the problem; see `Solver`."""

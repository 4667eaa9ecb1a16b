"""Reuse of an assimilating solver's work for other observations or loads of the same finger."""

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol, runtime_checkable

from geometry.observations import Observations
from solvers.problem import Problem
from solvers.solution import Solution
from solvers.solver import Solver


@runtime_checkable
class Refittable(Protocol):
    """A solver that shares work between fits to different observations of the same markers."""

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """A function that solves the problem with other observations, like `solve` but without `left_out`."""
        ...


@runtime_checkable
class Transferable(Protocol):
    """A solver whose estimates at one load hold at another."""

    def transferred(self, solution: Solution, problem: Problem, other: Problem) -> Solution:
        """The solution of another problem with the parameters estimated in a solution of the first."""
        ...


def refitter(solver: Solver, problem: Problem) -> Callable[[Observations], Solution]:
    """A function that solves a problem for any observations, sharing work where the solver can."""
    if isinstance(solver, Refittable):
        return solver.refitter(problem)
    return lambda observations: solver.solve(replace(problem, observations=observations))

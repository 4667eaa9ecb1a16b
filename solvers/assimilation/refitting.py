"""A solver that assimilates, for other observations and other loads of the same finger."""

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
        """What gives the solution of `solve` for the problem with observations, but for `left_out`."""
        ...


@runtime_checkable
class Transferable(Protocol):
    """A solver that says what it learnt at one load in terms that hold at another."""

    def transferred(self, solution: Solution, problem: Problem, other: Problem) -> Solution:
        """The solution of another problem with what a solution of the first one found."""
        ...


def refitter(solver: Solver, problem: Problem) -> Callable[[Observations], Solution]:
    """What solves a problem for any observations, sharing what the solver can share."""
    if isinstance(solver, Refittable):
        return solver.refitter(problem)
    return lambda observations: solver.solve(replace(problem, observations=observations))

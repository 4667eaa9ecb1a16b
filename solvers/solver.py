"""The interface of a solver: settings live in the solver, the problem is the argument."""

from collections.abc import Callable
from typing import Protocol, runtime_checkable

from solvers.problem import Problem
from solvers.solution import Solution

Progress = Callable[[float, str], None]
"""Called with the fraction done (0 to 1) and a short text; may be ignored by a solver that is quick."""


def silent(fraction: float, text: str) -> None:
    """A progress report that nobody reads."""


@runtime_checkable
class Solver(Protocol):
    """Something that solves a `Problem`.

    A solver is made without arguments for its defaults; `name` is what it is called by on the command line.
    """

    name: str

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve `problem`.

        Raises:
            UserError: If the problem is of a kind that the solver does not have.
        """
        ...

    def settings(self) -> dict[str, object]:
        """Every setting that changes the result, as JSON-ready values; recorded with the result."""
        ...

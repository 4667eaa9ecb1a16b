"""The border between the program and a solver of another package."""

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.runtime.errors import UserError
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution, Status
from pinnray.solvers.solver import Progress, SolverFailedError, refitter, silent, solved
from tests.solvers.conftest import observed_at


class Bending:
    """v = -0.01 x²."""

    def displacement(self, location: LocatedPoints) -> Any:
        x = location.points[:, 0]
        return np.column_stack([0 * x, -0.01 * x**2])

    def gradient(self, location: LocatedPoints) -> Any:
        gradient = np.zeros((len(location.points), 2, 2))
        gradient[:, 1, 0] = -0.02 * location.points[:, 0]
        return gradient


class Field(Bending):
    """The same with a fault."""

    def __init__(self, **faulty: Callable[[Any], Any]) -> None:
        for name, fault in faulty.items():
            right = getattr(self, name)
            setattr(self, name, lambda location, right=right, fault=fault: fault(right(location)))


@dataclass
class Beam:
    """A solver whose answer is changed by a function, or has other fields."""

    fault: Callable[[Solution], Any] | dict[str, Any]
    name: str = "beam"
    laws: tuple[str, ...] = ("linear",)
    loads: tuple[str, ...] = ("mean",)

    def settings(self) -> dict[str, object]:
        return {}

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        status = Status(True, "by a formula")
        solution = Solution("beam", problem, Bending(), 1.0, np.zeros(2), status, {"seconds": 0.0})
        return replace(solution, **self.fault) if isinstance(self.fault, dict) else self.fault(solution)


def spoilt(array: Any) -> Any:
    array[3] = np.nan
    return array


def ended(solution: Solution) -> None:
    sys.exit(0)


def test_a_marker_that_was_seen_has_a_prediction_without_it(coarse_mesh: TriangleMesh) -> None:
    """Else its mean error would be no number."""
    still, left_out = np.zeros((2, 9, 2))
    left_out[3] = np.nan
    beam = Beam({"left_out": left_out, "solver": "fem"})
    unseen, seen = (observed_at(coarse_mesh.markers, still, 0.0, np.arange(9) != row) for row in (3, 4))
    assert solved(beam, Problem(coarse_mesh, observations=unseen)).solver == "beam"
    with pytest.raises(UserError, match="left_out is not finite everywhere"):
        solved(beam, Problem(coarse_mesh, observations=seen))


def test_a_refit_is_checked_like_a_solution(coarse_mesh: TriangleMesh) -> None:
    class Refitted(Beam):
        def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
            return lambda seen: self.solve(replace(problem, observations=seen))

    seen = observed_at(coarse_mesh.markers, np.zeros((9, 2)), 0.0)
    with pytest.raises(UserError, match="beam: its displacement is not finite everywhere"):
        refitter(Refitted({"field": Field(displacement=spoilt)}), Problem(coarse_mesh))(seen)
    with pytest.raises(SolverFailedError, match="LinAlgError: Singular matrix"):
        refitter(Refitted(lambda solution: np.linalg.inv(np.zeros((2, 2)))), Problem(coarse_mesh))(seen)


def test_an_exception_tells_the_place_in_the_solvers_own_folder(coarse_mesh: TriangleMesh) -> None:
    """Not the line of the library that it called."""
    with pytest.raises(
        SolverFailedError, match=r"LinAlgError: Singular matrix \(.*test_solver\.py:"
    ) as caught:
        solved(Beam(lambda solution: np.linalg.inv(np.zeros((2, 2)))), Problem(coarse_mesh))
    assert isinstance(caught.value.__cause__, np.linalg.LinAlgError)

"""The border between the program and a solver of another package."""

import re
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from geometry.errors import UserError
from geometry.finger.design import Design
from geometry.mesh.point_location import LocatedPoints
from geometry.mesh.triangle_mesh import TriangleMesh
from geometry.observations import Observations
from solvers.problem import Material, Problem
from solvers.registry import make_solver
from solvers.solution import Solution, Status
from solvers.solver import Progress, SolverFailedError, refitter, silent, solved
from tests.meshes import permuted
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


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (lambda solution: None, "beam returned None as its Solution"),
        (lambda solution: {"energy": 1.0}, "beam returned a dict as its Solution"),
        (ended, r"beam ended the program \(exit code 0\)"),
        ({"status": "converged"}, "beam returned a str as its Status"),
        ({"energy": None}, "energy that is None"),
        ({"energy": np.nan}, "energy that is not finite"),
        ({"energy": np.ones(3)}, r"energy of shape \(3,\)"),
        ({"reaction": 4.0}, r"reaction of shape \(\); it must have .* \(2,\)"),
        ({"reaction": ["0", "1"]}, "reaction that is of type <U1"),
        ({"field": Field(displacement=np.transpose)}, "displacement of shape"),
        ({"field": Field(displacement=lambda _: None)}, "displacement that is None"),
        ({"field": Field(displacement=spoilt)}, "displacement that is not finite"),
        ({"field": Field(displacement=lambda a: a + 1j)}, "displacement that is of type complex128"),
        ({"field": Field(displacement=lambda a: a.astype(object))}, "displacement that is of type object"),
        ({"field": Field(displacement=lambda a: np.ma.masked_less(a, -1))}, "displacement that is a Masked"),
        ({"field": Field(gradient=lambda a: a[:, 0])}, "gradient of shape"),
        ({"field": Field(gradient=spoilt)}, "gradient that is not finite"),
        ({"field": Field(gradient=np.ndarray.tolist)}, "gradient that is a list"),
        ({"field": Field(gradient=lambda gradient: gradient["x"])}, "raised IndexError"),
        ({"field": None}, "field that is None, without a method displacement"),
        ({"stats": None}, "stats that are None, not a dictionary"),
        ({"history": None}, "history that is None, not a dictionary"),
        ({"history": {"energy": [1, 2], "epoch": [1]}}, "history whose columns differ in length"),
        ({"problem": None}, "Solution of None; it must have the problem"),
        (
            lambda solution: replace(solution, problem=Problem(permuted(solution.problem.mesh, 0))),
            "Solution on another mesh",
        ),
        ({"left_out": np.zeros((9, 2))}, r"left_out of shape \(9, 2\)"),
    ],
)
def test_what_is_no_solution_is_refused_with_the_solvers_name(fault, said, coarse_mesh) -> None:
    """A fault is a function of the solution, or the fields that are replaced in it."""
    change = fault if callable(fault) else lambda solution: replace(solution, **fault)
    with pytest.raises(UserError, match=f"solver beam .*{said}|solver {said}"):
        solved(Beam(change), Problem(coarse_mesh))


def test_a_marker_that_was_seen_has_a_prediction_without_it(coarse_mesh: TriangleMesh) -> None:
    """Else its mean error would be no number."""
    seen = observed_at(coarse_mesh.markers, np.zeros((9, 2)), 0.0, np.arange(9) != 3)
    for hidden, sound in ((3, True), (4, False)):
        left_out = np.zeros((9, 2))
        left_out[hidden] = np.nan
        beam = Beam(lambda solution, left_out=left_out: replace(solution, left_out=left_out))
        if sound:
            solved(beam, Problem(coarse_mesh, observations=seen))
            continue
        with pytest.raises(UserError, match="left_out that is not finite everywhere"):
            solved(beam, Problem(coarse_mesh, observations=seen))


class Refitted(Beam):
    """A solver that fits again, with a displacement that is no number."""

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        return lambda seen: self.solve(replace(problem, observations=seen))


def test_a_refit_is_checked_like_a_solution(coarse_mesh: TriangleMesh) -> None:
    beam = Refitted(lambda solution: replace(solution, field=Field(displacement=spoilt)))
    seen = observed_at(coarse_mesh.markers, np.zeros((9, 2)), 0.0)
    with pytest.raises(UserError, match="beam returned a displacement that is not finite everywhere"):
        refitter(beam, Problem(coarse_mesh))(seen)


@pytest.mark.parametrize("name", ["fem-asm", "fem-id", "gp", "statfem", "pinn-asm", "pinn-id"])
def test_markers_of_which_none_was_seen_are_refused(name: str, coarse_mesh: TriangleMesh) -> None:
    unseen = observed_at(coarse_mesh.markers, np.zeros((9, 2)), 0.0, np.zeros(9, dtype=bool))
    solver = make_solver(name)
    problem = Problem(coarse_mesh, Material(law=solver.laws[0]), observations=unseen)
    with pytest.raises(UserError, match="none of the markers is visible; at least one is needed"):
        solver.solve(problem)


def test_an_exception_tells_the_place_in_the_solvers_own_folder(coarse_mesh: TriangleMesh) -> None:
    """Not the line of the library that it called."""
    singular = Beam(lambda solution: np.linalg.inv(np.zeros((2, 2))))
    with pytest.raises(SolverFailedError) as caught:
        solved(singular, Problem(coarse_mesh))
    said = r"solver beam raised LinAlgError: Singular matrix \(.*tests.solvers.test_solver\.py:\d+\)"
    assert re.fullmatch(said, str(caught.value))
    assert isinstance(caught.value.__cause__, np.linalg.LinAlgError)


def test_a_sound_solution_passes(coarse_mesh: TriangleMesh) -> None:
    assert solved(Beam(), Problem(coarse_mesh)).energy == 1.0


def test_a_solution_bears_the_name_of_its_solver(coarse_mesh: TriangleMesh) -> None:
    passed_on = Beam(lambda solution: replace(solution, solver="fem"))
    assert solved(passed_on, Problem(coarse_mesh)).solver == "beam"


def test_a_beam_model_sees_the_thickness_of_a_wall(coarse_mesh: TriangleMesh) -> None:
    thick = Design(front_thickness=2.2)
    problem = Problem(coarse_mesh, finger=thick)
    assert replace(problem, observations=None).finger.front_thickness == 2.2
    assert problem.digest != Problem(coarse_mesh, finger=Design()).digest

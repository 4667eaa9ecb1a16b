"""A small body with a known solution, and how to make evaluations of it; units mm and MPa."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.evaluation import Evaluation, evaluated
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import DisplacementField, ErrorEstimate, Solution, Status

COLUMNS, ROWS = 24, 8


class BendingField:
    """u = scale (0.01 y^2, -0.02 x^2): strain xx = 0, yy = 0, xy = scale (0.01 y - 0.02 x)."""

    def __init__(self, scale: float) -> None:
        self.scale = scale

    def displacement(self, location: LocatedPoints) -> FloatArray:
        x, y = location.points.T
        return self.scale * np.stack([0.01 * y**2, -0.02 * x**2], axis=1)

    def gradient(self, location: LocatedPoints) -> FloatArray:
        x, y = location.points.T
        gradient = np.zeros((len(x), 2, 2))
        gradient[:, 0, 1] = self.scale * 0.02 * y
        gradient[:, 1, 0] = -self.scale * 0.04 * x
        return gradient


def closed_form(mesh: TriangleMesh, field: DisplacementField, **changes: Any) -> Solution:
    """A converged solution with a given field; energy 1 N mm/mm and no reaction unless changed."""
    solution = Solution(
        solver="given",
        problem=Problem(mesh),
        field=field,
        energy=1.0,
        reaction=np.zeros(2),
        status=Status(True, "a given displacement"),
        stats={"seconds": 1.0},
    )
    return replace(solution, **changes)


def error_of(scale: float, exact: float, mesh: TriangleMesh) -> ErrorEstimate:
    """The error of the known solution times one factor where that times another would be exact."""
    off = abs(exact / scale - 1)
    markers = (BendingField(exact - scale)).displacement(mesh.locate(mesh.markers))
    return ErrorEstimate(off, off, off, markers, BendingField(exact))


@pytest.fixture(scope="session")
def mesh() -> TriangleMesh:
    """The rectangle 0 <= x <= 12, -4 <= y <= 0 in squares of 0.5 mm, each cut in two; three markers."""
    x, y = np.meshgrid(np.linspace(0, 12, COLUMNS + 1), np.linspace(-4, 0, ROWS + 1))
    number = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (
        part.ravel() for part in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1])
    )
    top = number[-1]
    return TriangleMesh(
        points=np.stack([x.ravel(), y.ravel()], axis=1),
        triangles=np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]),
        boundaries={
            "base": np.stack([number[1:, 0], number[:-1, 0]], axis=1),
            "front": np.stack([top[1:], top[:-1]], axis=1),
            "back": np.stack([number[0, :-1], number[0, 1:]], axis=1),
            "contact": np.stack([top[11:15], top[10:14]], axis=1),
        },
        marker_nodes=number[6, [4, 12, 20]],
        contact_node=int(top[12]),
    )


@pytest.fixture(scope="session")
def evaluate(mesh: TriangleMesh) -> Callable[..., Evaluation]:
    """`evaluate("name", scale=1.0, ...)`: the evaluation of the known solution times a factor.

    With `off`, the solver says that the exact solution is larger by that share.
    """

    def make(
        solver: str,
        scale: float = 1.0,
        *,
        converged: bool = True,
        message: str = "solved directly",
        history: dict[str, FloatArray] | None = None,
        off: float | None = None,
    ) -> Evaluation:
        solution = closed_form(
            mesh,
            BendingField(scale),
            solver=solver,
            energy=2.0 * scale**2,
            reaction=np.array([0.0, -0.5 * scale]),
            status=Status(converged, message),
            stats={"seconds": 1.25, "unknowns": 450},
            history=history or {},
            error=None if off is None else error_of(scale, scale * (1 + off), mesh),
        )
        family = "neural network" if solver.startswith("pinn") else "finite elements"
        return replace(evaluated(solution, mesh), family=family)

    return make


@pytest.fixture(scope="session")
def fem(evaluate: Callable[..., Evaluation]) -> Evaluation:
    """The reference."""
    return evaluate("fem")


@pytest.fixture(scope="session")
def estimated(evaluate: Callable[..., Evaluation]) -> Evaluation:
    """The reference with an estimate of its own error: the exact solution is 1 % larger everywhere."""
    return evaluate("fem", off=0.01)


@pytest.fixture(scope="session")
def pinn(evaluate: Callable[..., Evaluation]) -> Evaluation:
    """One tenth larger everywhere, with a record of its energy."""
    record = {"units": np.array([10.0, 100.0, 1000.0]), "energy": np.array([90.0, 4.0, 2.42])}
    return evaluate("pinn-std", 1.1, history=record)


@pytest.fixture(scope="session")
def failed(evaluate: Callable[..., Evaluation]) -> Evaluation:
    """Three times too large, and not converged."""
    return evaluate(
        "fem-nonlinear", 3.0, converged=False, message="stopped after 20 steps; try more load_steps"
    )


@pytest.fixture(scope="session")
def observe(mesh: TriangleMesh) -> Callable[..., Observations]:
    """`observe(displacements, ...)`: observations at the markers of the mesh, of which some can be hidden."""

    def make(
        displacements: FloatArray, *, simulated: bool = True, hidden: tuple[int, ...] = (), source: str = ""
    ) -> Observations:
        visible = np.ones(len(mesh.markers), dtype=bool)
        visible[list(hidden)] = False
        said = "simulated by another solver" if simulated else "measured by camera A"
        return Observations(
            points=mesh.markers,
            displacements=displacements,
            standard_deviations=np.zeros((len(mesh.markers), 2)),
            visible=visible,
            source=source or said,
            simulated=simulated,
            marker_radius=0.8,
        )

    return make


@pytest.fixture(scope="session")
def observations(observe: Callable[..., Observations], fem: Evaluation) -> Observations:
    """Simulated: 0.3 mm more in u and 0.4 mm less in v than the reference, at all three markers."""
    return observe(fem.marker_displacement + np.array([0.3, -0.4]))


@pytest.fixture(scope="session")
def compared(mesh: TriangleMesh, observations: Observations) -> Callable[..., Results]:
    """`compared(fem, pinn, truth=..., ...)`: their comparison; the first is the reference."""

    def make(*evaluations: Evaluation, **changes: Any) -> Results:
        return replace(Results(Design(), mesh, observations, evaluations, evaluations[0]), **changes)

    return make


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The output of a whole comparison of the default finger with `few_elements`: not to be changed."""
    from pinnray.cli import main

    out = tmp_path_factory.mktemp("finished") / "run"
    options = ["--solvers", "fem,fem-nonlinear", "--mesh-size", "1.0", "--quiet"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(finger_mesh.__kwdefaults__, "across", 1)
        assert main(["compare", *options, "--out", str(out)]) == 0
    return out

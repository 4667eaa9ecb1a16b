"""`fem` against scikit-fem: the same mesh, elements, material and load; and `fem` for a second load."""

import time
from collections.abc import Callable
from typing import TypeVar

from rich.table import Table

from benchmarks.verification.cases.another_program import scikit_fem
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.tables import terminal_table
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Load, Problem

REPEATS = 3
HEADER = (
    *("degree", "size, mm", "unknowns", "fem, s", "scikit-fem, s", "scikit-fem / fem"),
    *("energies differ by", "another functional, s", "another stroke, s"),
)
Result = TypeVar("Result")


def main() -> Table:
    """Time both and compare their energies; then time further solves."""
    rows = []
    for degree, size in ((1, 0.5), (2, 0.5), (1, 0.25), (2, 0.25)):
        problem = Problem(finger_mesh(Design(), settings=MeshSettings(size=size)))
        solver = FemSolver(degree, estimate=False)
        ours, our_time = _timed(lambda solver=solver, problem=problem: solver.solve(problem))
        (*_, theirs), their_time = _timed(lambda problem=problem, degree=degree: scikit_fem(problem, degree))
        prepared = solver.prepare(problem)
        others = [
            _timed(lambda prepared=prepared, load=load: (prepared.solve(load), prepared.solve(Load())))[1] / 2
            for load in (Load(kind="point"), Load(displacement=(0.0, -5.0)))
        ]
        prepared.destroy()
        rows.append(
            (
                *(str(degree), str(size), str(ours.stats["unknowns"]), f"{our_time:.2f}"),
                *(f"{their_time:.2f}", f"{their_time / our_time:.1f}"),
                *(f"{abs(ours.energy / theirs - 1):.1e}", *(f"{seconds:.3f}" for seconds in others)),
            )
        )
    title = f"The default problem, assembly and solve, best of {REPEATS}; other loads with one factorisation"
    return terminal_table(title, HEADER, rows)


def _timed(task: Callable[[], Result]) -> tuple[Result, float]:
    """The result and the shortest time of some runs, s."""
    times = []
    for _ in range(REPEATS):
        started = time.perf_counter()
        result = task()
        times.append(time.perf_counter() - started)
    return result, min(times)

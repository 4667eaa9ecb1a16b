"""`fem` against scikit-fem: the same mesh, elements, material and load; and `fem` for a second load."""

import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np
import skfem
from rich.table import Table
from skfem.models.elasticity import linear_elasticity

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.tables import terminal_table
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Load, Problem, contact_functional

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
        theirs, their_time = _timed(lambda problem=problem, degree=degree: scikit_fem_energy(problem, degree))
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


def scikit_fem_energy(problem: Problem, degree: int) -> float:
    """The energy of the default load by scikit-fem and SciPy's direct solver, N mm / mm."""
    mesh, lame = problem.mesh, problem.material.lame
    element = skfem.ElementVector(skfem.ElementTriP1() if degree == 1 else skfem.ElementTriP2())
    basis = skfem.Basis(skfem.MeshTri(mesh.points.T.copy(), mesh.triangles.T.copy()), element)
    stiffness = skfem.asm(linear_elasticity(lame.λ, lame.μ), basis)
    points, weights = contact_functional(problem)
    # Rows of the probing matrix are the components at the points, the points running fastest.
    loads = (np.kron(np.eye(2), weights) @ basis.probes(points.T)).T
    clamped = basis.get_dofs(lambda x: np.isclose(x[0], 0.0))
    influence = np.stack([skfem.solve(*skfem.condense(stiffness, load, D=clamped)) for load in loads.T], 1)
    forces = np.linalg.solve(loads.T @ influence, problem.load.values)
    return 0.5 * float(forces @ problem.load.values)


def _timed(task: Callable[[], Result]) -> tuple[Result, float]:
    """The result and the shortest time of some runs, s."""
    times = []
    for _ in range(REPEATS):
        started = time.perf_counter()
        result = task()
        times.append(time.perf_counter() - started)
    return result, min(times)

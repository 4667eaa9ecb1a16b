"""`fem` against scikit-fem: same mesh, elements, material and load; each assembles and solves by itself."""

import time
from collections.abc import Callable
from functools import partial
from typing import TypeVar

import numpy as np
import skfem
from rich.table import Table
from skfem.models.elasticity import linear_elasticity

from geometry.cache import finger_mesh
from geometry.design import Design
from geometry.settings import MeshSettings
from solvers.fem.linear import FemSolver
from solvers.problem import Problem, contact_functional

REPEATS = 3
Result = TypeVar("Result")


def scikit_fem_energy(problem: Problem, degree: int) -> float:
    """The energy of the default load by scikit-fem and SciPy's direct solver, N mm / mm."""
    mesh, lame = problem.mesh, problem.material.lame
    element = skfem.ElementVector(skfem.ElementTriP1() if degree == 1 else skfem.ElementTriP2())
    triangles = skfem.MeshTri(mesh.points.T.copy(), mesh.triangles.T.copy())
    basis = skfem.Basis(triangles, element)
    stiffness = skfem.asm(linear_elasticity(lame.λ, lame.μ), basis)
    points, weights = contact_functional(problem)
    # Rows of the probing matrix are the components at the points, the points running fastest.
    probes = basis.probes(points.T).tocsr()
    loads = np.stack(
        [probes[axis * len(points) : (axis + 1) * len(points)].T @ weights for axis in range(2)], 1
    )
    clamped = basis.get_dofs(lambda x: np.isclose(x[0], 0.0))
    influence = np.stack([skfem.solve(*skfem.condense(stiffness, load, D=clamped)) for load in loads.T], 1)
    forces = np.linalg.solve(loads.T @ influence, problem.load.values)
    return 0.5 * float(forces @ problem.load.values)


def main() -> Table:
    """Time both and compare their energies."""
    table = Table(title="fem against scikit-fem: assembly and solve of the default problem, best of 3")
    for column in (
        "degree",
        "size, mm",
        "unknowns",
        "fem, s",
        "scikit-fem, s",
        "ratio",
        "energies differ by",
    ):
        table.add_column(column, justify="right")
    for degree, size in ((1, 0.5), (2, 0.5), (1, 0.25), (2, 0.25)):
        problem = Problem(finger_mesh(Design(), settings=MeshSettings(size=size)))
        ours, our_time = _timed(partial(FemSolver(degree=degree).solve, problem))
        theirs, their_time = _timed(partial(scikit_fem_energy, problem, degree))
        table.add_row(
            str(degree),
            str(size),
            str(ours.stats["unknowns"]),
            f"{our_time:.2f}",
            f"{their_time:.2f}",
            f"{their_time / our_time:.1f}",
            f"{abs(ours.energy / theirs - 1):.1e}",
        )
    return table


def _timed(task: Callable[[], Result]) -> tuple[Result, float]:
    times = []
    for _ in range(REPEATS):
        started = time.perf_counter()
        result = task()
        times.append(time.perf_counter() - started)
    return result, min(times)

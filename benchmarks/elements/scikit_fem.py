"""`fem` against scikit-fem and against its own factorisation: same mesh, elements, material and load."""

import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np
import skfem
from rich.table import Table
from skfem.models.elasticity import linear_elasticity

from compare.runtime.tables import terminal_table
from geometry.cache import finger_mesh
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from solvers.fem.linear import FemSolver
from solvers.fem.linear_equilibrium import LinearElasticity, LinearEquilibrium
from solvers.fem.linear_solvers import Factorisation
from solvers.lagrange import LagrangeSpace
from solvers.problem import Load, Problem, contact_functional

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


def factorisation_and_solves(problem: Problem, degree: int) -> float:
    """Time of MUMPS for the factorisation and two back-substitutions, s."""
    equilibrium = LinearEquilibrium.of(
        LinearElasticity.of(problem, LagrangeSpace(problem.mesh, degree), "direct")
    )
    elasticity, times = equilibrium.elasticity, []
    for _ in range(REPEATS):
        matrix = elasticity.assemble(equilibrium.clamped)
        started = time.perf_counter()
        factors = Factorisation(elasticity.distributed, matrix, equilibrium.clamped, positive_definite=True)
        for functional in equilibrium.load.rows:
            factors.solve(functional)
        times.append(time.perf_counter() - started)
        factors.destroy()
    equilibrium.factors.destroy()
    return min(times)


def main() -> Table:
    """Time both and compare their energies; then time further solves."""
    rows = []
    for degree, size in ((1, 0.5), (2, 0.5), (1, 0.25), (2, 0.25)):
        problem = Problem(finger_mesh(Design(), settings=MeshSettings(size=size)))
        solver = FemSolver(degree, estimate=False)
        ours, our_time = _timed(lambda solver=solver, problem=problem: solver.solve(problem))
        theirs, their_time = _timed(lambda problem=problem, degree=degree: scikit_fem_energy(problem, degree))
        mumps_time = factorisation_and_solves(problem, degree)
        prepared = solver.prepare(problem)
        others = [
            _timed(lambda prepared=prepared, load=load: (prepared.solve(load), prepared.solve(Load())))[1] / 2
            for load in (Load(kind="point"), Load(displacement=(0.0, -5.0)))
        ]
        prepared.destroy()
        rows.append(
            (
                *(
                    str(degree),
                    str(size),
                    str(ours.stats["unknowns"]),
                    f"{our_time:.2f}",
                    f"{mumps_time:.2f}",
                ),
                *(f"{our_time / mumps_time:.2f}", f"{their_time:.2f}", f"{their_time / our_time:.1f}"),
                f"{abs(ours.energy / theirs - 1):.1e}",
                *(f"{seconds:.3f}" for seconds in others),
            )
        )
    return terminal_table(
        f"The default problem, best of {REPEATS}: fem (assembly and solve), its factorisation with two "
        "back-substitutions alone, scikit-fem; and fem for other loads with one factorisation",
        (
            *("degree", "size, mm", "unknowns", "fem, s", "MUMPS alone, s", "fem / MUMPS", "scikit-fem, s"),
            *("scikit-fem / fem", "energies differ by", "another functional, s", "another stroke, s"),
        ),
        rows,
    )


def _timed(task: Callable[[], Result]) -> tuple[Result, float]:
    """The result and the shortest time of some runs, s."""
    times = []
    for _ in range(REPEATS):
        started = time.perf_counter()
        result = task()
        times.append(time.perf_counter() - started)
    return result, min(times)

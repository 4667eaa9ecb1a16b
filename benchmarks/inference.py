"""Points a second that the trained networks evaluate, beside finite elements on the shared mesh.

The points are uniformly distributed in the default finger and located in the mesh beforehand. The preset
`paper` is timed untrained: its speed does not depend on its weights. Half a minute.
"""

import time

import numpy as np
from rich.table import Table

from geometry.cache import finger_mesh
from geometry.finger.design import Design
from geometry.mesh.point_location import LocatedPoints
from solvers.fem.linear import FemSolver
from solvers.pinn.finite_basis.local import PinnLocalSolver
from solvers.pinn.finite_basis.standard import PinnStdSolver
from solvers.pinn.paper.solver import PaperPinnSolver
from solvers.problem import Problem
from solvers.solver import Solver

POINTS = 1_000_000
SOLVERS: dict[str, Solver] = {
    "fem": FemSolver(),
    "pinn-std": PinnStdSolver(),
    "pinn-std, preset paper": PaperPinnSolver(epochs=1),
    "pinn-local": PinnLocalSolver(),
}


def main() -> Table:
    """Evaluate."""
    table = Table(title=f"Million points a second, of {POINTS:,}")
    for column in ("solver", "displacement", "gradient"):
        table.add_column(column, justify="left" if column == "solver" else "right")
    problem = Problem(finger_mesh(Design()))
    location = _drawn(problem)
    for name, solver in SOLVERS.items():
        solution = solver.solve(problem)
        speeds = (_speed(function, location) for function in (solution.displacement, solution.gradient))
        table.add_row(name, *(f"{speed:.2f}" for speed in speeds))
    return table


def _drawn(problem: Problem) -> LocatedPoints:
    mesh, rng = problem.mesh, np.random.default_rng(0)
    chosen = rng.choice(len(mesh.triangles), POINTS, p=mesh.areas / mesh.areas.sum())
    barycentric = rng.dirichlet(np.ones(3), POINTS)
    return mesh.locate(np.einsum("nc,ncx->nx", barycentric, mesh.points[mesh.triangles[chosen]]))


def _speed(function, location: LocatedPoints) -> float:
    """The best of three, in million points a second."""
    seconds = []
    for _ in range(3):
        started = time.perf_counter()
        function(location)
        seconds.append(time.perf_counter() - started)
    return len(location.points) / min(seconds) / 1e6

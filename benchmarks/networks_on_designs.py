"""The networks, untouched, on twelve fingers drawn from the admissible range, against graded finite elements.

The reference has quadratic elements graded to 0.01 mm at the corners. Allow ten minutes.
"""

import numpy as np
from rich.table import Table

from compare.evaluation import Evaluation
from compare.metrics import reference_differences
from geometry.cache import finger_mesh
from geometry.settings import MeshSettings
from solvers.fem.linear import FemSolver
from solvers.pinn.local import PinnLocalSolver
from solvers.pinn.standard import PinnStdSolver
from solvers.problem import Problem
from tests.geometry.test_mesher import random_design

DESIGNS = 12


def main() -> Table:
    """Train and compare."""
    table = Table(title="Networks on drawn fingers: relative L2 differences from graded finite elements")
    columns = ("design", "ribs", "solver", "time, s", "L2, %", "von Mises, %", "markers, mm", "converged")
    for column in columns:
        table.add_column(column, justify="left" if column in ("solver", "converged") else "right")
    for seed in range(DESIGNS):
        design = random_design(seed)
        mesh = finger_mesh(design)
        graded = finger_mesh(design, settings=MeshSettings(corner_size=0.01))
        reference = Evaluation.of(FemSolver().solve(Problem(graded)), mesh)
        for solver in (PinnStdSolver(), PinnLocalSolver()):
            solution = solver.solve(Problem(mesh))
            differences = reference_differences(Evaluation.of(solution, mesh), reference)
            figures = (
                float(solution.stats["seconds"]),
                100 * differences.displacement.rel_l2,
                100 * differences.von_mises.rel_l2,
                differences.mae_markers,
            )
            table.add_row(
                str(seed),
                str(design.rib_count),
                solver.name,
                *(f"{np.format_float_positional(figure, 2, fractional=False)}" for figure in figures),
                "yes" if solution.status.converged else "no",
            )
    return table

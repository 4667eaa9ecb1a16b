"""`pinn-std`: error against finite elements and time, by the number of hidden units and for three seeds."""

import numpy as np
from rich.table import Table

from compare.evaluation import Evaluation
from compare.metrics import reference_differences
from geometry.cache import finger_mesh
from geometry.design import Design
from solvers.fem.linear import FemSolver
from solvers.pinn.standard import PinnStdSolver
from solvers.problem import Problem


def main() -> Table:
    """Train and compare."""
    table = Table(
        title="pinn-std on the default finger against fem (P2, 0.25 mm): mean and range over 3 seeds"
    )
    for column in ("units", "time, s", "rel. L2 displacement, %", "rel. L2 von Mises, %", "markers, mm"):
        table.add_column(column, justify="right")
    mesh = finger_mesh(Design())
    problem = Problem(mesh)
    reference = Evaluation.of(FemSolver().solve(problem), mesh)
    for rounds in (2, 3, 4):
        rows = []
        for seed in range(3):
            solution = PinnStdSolver(rounds=rounds, tolerance=1e-9, seed=seed).solve(problem)
            differences = reference_differences(Evaluation.of(solution, mesh), reference)
            rows.append(
                (
                    float(solution.stats["seconds"]),
                    100 * differences.displacement.rel_l2,
                    100 * differences.von_mises.rel_l2,
                    differences.mae_markers,
                )
            )
        columns = np.array(rows).T
        cells = (f"{values.mean():.3g} ({values.min():.3g} to {values.max():.3g})" for values in columns)
        table.add_row(str(rounds * 500), *cells)
    return table

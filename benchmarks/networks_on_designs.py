"""The networks with default settings on twelve random admissible fingers, against graded finite elements.

The reference has quadratic elements graded to 0.01 mm at the corners and an eighth of the contact's width
there. "Own estimate" is the network's own error estimate. Allow ten minutes.
"""

from rich.table import Table

from compare.evaluation.evaluation import Evaluation
from compare.evaluation.metrics import reference_differences
from geometry.cache import finger_mesh
from geometry.mesh.settings import MeshSettings
from solvers.fem.linear import FemSolver
from solvers.pinn.finite_basis.local import PinnLocalSolver
from solvers.pinn.finite_basis.standard import PinnStdSolver
from solvers.problem import Problem
from tests.geometry.test_mesher import random_design

DESIGNS = 12
COLUMNS = (
    *("design", "ribs", "solver", "time, s", "L2, %"),
    *("von Mises, %", "markers, mm", "own estimate, %", "converged"),
)


def main() -> Table:
    """Train and compare."""
    table = Table(title="Networks on drawn fingers: relative L2 differences from graded finite elements")
    for column in COLUMNS:
        justify = "left" if column in ("solver", "converged") else "right"
        table.add_column(column, justify=justify, no_wrap=True)
    for seed in range(DESIGNS):
        design = random_design(seed)
        mesh = finger_mesh(design)
        fine = MeshSettings(corner_size=0.01, contact_size=design.contact_width / 8)
        graded = finger_mesh(design, settings=fine)
        reference = Evaluation.of(FemSolver().solve(Problem(graded)), mesh)
        for solver in (PinnStdSolver(), PinnLocalSolver()):
            solution = solver.solve(Problem(mesh))
            differences = reference_differences(Evaluation.of(solution, mesh), reference)
            figures = (
                float(solution.stats["seconds"]),
                100 * differences.displacement.rel_l2,
                100 * differences.von_mises.rel_l2,
                differences.mae_markers,
                100 * float(solution.history["estimated_error"][-1]),
            )
            table.add_row(
                str(seed),
                str(design.rib_count),
                solver.name,
                *(f"{figure:.2g}" for figure in figures),
                "yes" if solution.status.converged else "no",
            )
    return table

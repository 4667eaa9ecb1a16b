"""The networks with default settings on twelve random admissible fingers, against graded finite elements.

The reference has quadratic elements graded to 0.01 mm at the corners and an eighth of the contact's width
there. "Own estimate" is the network's own error estimate. Allow ten minutes.
"""

from collections.abc import Mapping

from rich.table import Table

from compare.evaluation.evaluation import Evaluation
from compare.evaluation.metrics import reference_differences
from geometry.cache import finger_mesh
from geometry.finger.finger import Finger
from geometry.mesh.settings import MeshSettings
from solvers.fem.linear import FemSolver
from solvers.pinn.finite_basis.local import PinnLocalSolver
from solvers.pinn.finite_basis.standard import PinnStdSolver
from solvers.problem import Problem
from tests.geometry.test_mesher import random_design

DESIGNS = 12
COLUMNS = (
    *("finger", "cavities", "solver", "time, s", "L2, %"),
    *("von Mises, %", "markers, mm", "own estimate, %", "converged"),
)


def main() -> Table:
    """Train and compare."""
    return compared("Networks on random fingers", {str(seed): random_design(seed) for seed in range(DESIGNS)})


def compared(title: str, fingers: Mapping[str, Finger]) -> Table:
    """The networks on fingers, each beside `fem` on the same mesh, against graded finite elements."""
    table = Table(title=f"{title}: relative L2 differences from graded finite elements")
    for column in COLUMNS:
        justify = "left" if column in ("finger", "solver", "converged") else "right"
        table.add_column(column, justify=justify, no_wrap=True)
    for name, finger in fingers.items():
        mesh = finger_mesh(finger)
        fine = MeshSettings(corner_size=0.01, contact_size=finger.contact_width / 8)
        graded = finger_mesh(finger, settings=fine)
        reference = Evaluation.of(FemSolver().solve(Problem(graded)), mesh)
        for solver in (FemSolver(), PinnStdSolver(), PinnLocalSolver()):
            solution = solver.solve(Problem(mesh))
            differences = reference_differences(Evaluation.of(solution, mesh), reference)
            own = solution.history.get("estimated_error")
            figures = (
                float(solution.stats["seconds"]),
                100 * differences.displacement.rel_l2,
                100 * differences.von_mises.rel_l2,
                differences.mae_markers,
            )
            table.add_row(
                name,
                str(len(finger.section.cavities)),
                solver.name,
                *(f"{figure:.2g}" for figure in figures),
                f"{100 * float(own[-1]):.2g}" if own is not None else "",
                "yes" if solution.status.converged else "no",
            )
    return table

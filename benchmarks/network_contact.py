"""Networks under a rigid cylinder against finite elements at finite strain; takes up to twenty minutes.

The default finger, neo-Hookean, stroke 10 mm. The reference has quadratic elements graded to 0.02 mm at the
corners and 0.1 mm at the contact; `fem-nonlinear` on the shared mesh stands beside the networks.
"""

from rich.table import Table

from compare.evaluation.evaluation import Evaluation
from compare.evaluation.metrics import force_error, reference_differences
from geometry.cache import finger_mesh
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from solvers.fem.finite_strain.solver import FemNonlinearSolver
from solvers.pinn.finite_basis.local import PinnLocalSolver
from solvers.pinn.finite_basis.standard import PinnStdSolver
from solvers.problem import Load, Material, Problem
from solvers.solver import Solver

RADII = (5.0, 10.0)
"""Of the cylinder, mm."""
GRADED = MeshSettings(corner_size=0.02, contact_size=0.1)
COLUMNS = ("radius, mm", "solver", "time, s", "L2, %", "von Mises, %", "force, %", "converged")


def main() -> Table:
    """Press, and compare."""
    table = Table(title="A rigid cylinder on the default finger, against graded finite elements")
    for column in COLUMNS:
        justify = "left" if column in ("solver", "converged") else "right"
        table.add_column(column, justify=justify, no_wrap=True)
    mesh, graded = finger_mesh(Design()), finger_mesh(Design(), settings=GRADED)
    solvers: tuple[Solver, ...] = (FemNonlinearSolver(), PinnStdSolver(), PinnLocalSolver())
    for radius in RADII:
        problem = Problem(mesh, Material(law="neo-hookean"), Load(kind="cylinder", radius=radius))
        exact = FemNonlinearSolver().solve(Problem(graded, problem.material, problem.load))
        reference = Evaluation.of(exact, mesh)
        for solver in solvers:
            solution = solver.solve(problem)
            found = Evaluation.of(solution, mesh)
            to = reference_differences(found, reference)
            differences = (to.displacement.rel_l2, to.von_mises.rel_l2, force_error(found, reference))
            table.add_row(
                f"{radius:g}",
                solver.name,
                f"{solution.stats['seconds']:.3g}",
                *(f"{100 * value:.2g}" for value in differences),
                "yes" if solution.status.converged else "no",
            )
    return table

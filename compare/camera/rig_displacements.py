"""The displacements shown in a film of the virtual rig."""

from collections.abc import Sequence

from compare.evaluation.shared_mesh import shared_mesh
from compare.evaluation.virtual_experiment import experiment_source, simulate
from compare.runtime.stages import Stages
from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from geometry.mesh.triangle_mesh import TriangleMesh
from solvers.problem import Load, Material, Problem
from solvers.solver import Solver, with_law


def rig_displacements(
    design: Design,
    settings: MeshSettings,
    material: Material,
    load: Load,
    solvers: Sequence[Solver],
    stages: Stages,
) -> tuple[TriangleMesh, FloatArray, str]:
    """The mesh, its nodal displacements, shape (n, 2), mm, and one sentence on their source.

    Args:
        design: The finger.
        settings: Element sizes.
        material: The elastic law; a solver without it takes its own.
        load: The prescribed displacement of the contact.
        solvers: The solver of the displacements; none for the virtual experiment.
        stages: Shows the progress.

    Raises:
        UserError: If there are several solvers, or the solver does not converge.
    """
    if len(solvers) > 1:
        raise UserError("the rig films one finger; name one --solver")
    mesh, _ = shared_mesh(design, settings, stages)
    if not solvers:
        problem = Problem(mesh, material, load)
        with stages.stage("virtual experiment") as progress:
            return mesh, simulate(problem, progress).displacement(mesh.at_nodes()), experiment_source(problem)
    (solver,) = solvers
    problem = Problem(mesh, with_law(material, solver), load)
    with stages.stage(solver.name) as progress:
        solution = solver.solve(problem, progress)
    if not solution.status.converged:
        raise UserError(f"{solver.name} {solution.status.message}; its displacements are not filmed")
    source = f"displacements of {solver.name}, rendered by the virtual rig; no camera was involved"
    return mesh, solution.displacement(mesh.at_nodes()), source

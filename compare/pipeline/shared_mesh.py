"""The mesh that the solvers share, refined first if a tolerance asks for it."""

from collections.abc import Sequence

from pinnray.comparison.evaluation.plausibility import check_positions
from pinnray.comparison.pipeline.job import Job
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.runtime.stages import Stages
from pinnray.solvers.fem.adaptive_refinement import Adaptation
from pinnray.solvers.problem import Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solver import Solver


def shared_mesh(
    job: Job, solvers: Sequence[Solver], stages: Stages
) -> tuple[TriangleMesh, Adaptation | None]:
    """Mesh the finger of a job, and refine until `fem` knows the markers to a tolerance if the job has one.

    Args:
        job: What to compare; its measurements, if it has any, are of points of the finger.
        solvers: If `fem` is one of them, the degree of its elements is taken.
        stages: Shows the progress.

    Raises:
        UserError: If the mesh cannot be made or adapted.
    """
    with stages.stage("mesh"):
        mesh = finger_mesh(job.design, settings=job.mesh)
        if isinstance(job.measurements, Observations):
            check_positions(job.measurements, mesh)
    if job.adapt is None:
        return mesh, None
    make_solver("fem")  # or says which library is missing
    from pinnray.solvers.fem.adaptive_refinement import adapted

    degrees = [solver.settings()["degree"] for solver in solvers if solver.name == "fem"]
    problem = Problem(mesh, job.material.model_copy(update={"law": "linear"}), job.load)
    degree, section = int(str(degrees[0])) if degrees else 2, job.design.section
    with stages.stage("adapt") as progress:
        adaptation = adapted(problem, job.adapt, degree=degree, section=section, progress=progress)
        if not adaptation.reached:
            progress(1.0, adaptation.message)
    return adaptation.mesh, adaptation

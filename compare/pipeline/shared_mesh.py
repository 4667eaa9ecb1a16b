"""The mesh that the solvers share, refined first if a tolerance asks for it."""

from collections.abc import Callable, Sequence

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.stages import Stages
from pinnray.solvers.fem.adaptive_refinement import Adaptation
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solver import Solver


def shared_mesh(
    design: Finger,
    settings: MeshSettings | None,
    stages: Stages,
    *,
    tolerance: float | None = None,
    material: Material,
    load: Load,
    solvers: Sequence[Solver],
    check: Callable[[TriangleMesh], None] | None = None,
) -> tuple[TriangleMesh, Adaptation | None]:
    """Mesh a finger, and refine until `fem` knows the markers to a tolerance if one is given.

    Args:
        design: The finger.
        settings: Element sizes of the first mesh, as for `finger_mesh`.
        stages: Shows the progress.
        tolerance: Largest estimated error of u or v at a marker, mm.
        material: Elastic constants; the law is the linear one.
        load: What moves the finger.
        solvers: If `fem` is one of them, the degree of its elements is taken.
        check: Raises a `UserError` if the first mesh will not do.

    Raises:
        UserError: If the mesh cannot be made or adapted.
    """
    with stages.stage("mesh"):
        mesh = finger_mesh(design, settings=settings)
        if check is not None:
            check(mesh)
    if tolerance is None:
        return mesh, None
    make_solver("fem")  # or says which library is missing
    from pinnray.solvers.fem.adaptive_refinement import adapted

    degrees = [solver.settings()["degree"] for solver in solvers if solver.name == "fem"]
    problem = Problem(mesh, material.model_copy(update={"law": "linear"}), load)
    degree = int(str(degrees[0])) if degrees else 2
    with stages.stage("adapt") as progress:
        adaptation = adapted(problem, tolerance, degree=degree, section=design.section, progress=progress)
        if not adaptation.reached:
            progress(1.0, adaptation.message)
    return adaptation.mesh, adaptation

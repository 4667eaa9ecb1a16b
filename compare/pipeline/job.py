"""The job of a comparison: what is compared, and whether it can be."""

import sys
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from compare.camera.film import Film
from compare.evaluation.comparison import supported_solvers
from compare.evaluation.truths import SLIDING, TRUTHS, check_truths, check_walls
from compare.figures import check_formats
from geometry.errors import UserError
from geometry.finger.finger import Finger
from geometry.mesh.settings import MeshSettings
from geometry.observations import Observations
from solvers.fem.adaptive_refinement import check_adaptable
from solvers.problem import Load, Material
from solvers.solver import Solver, check_name
from vision.measurements import read_measurements


@dataclass(frozen=True)
class Job:
    """A comparison to make.

    Attributes:
        design: The finger.
        solvers: The solvers, in the order of tables and pictures.
        spare: Names of those that are left out, with a remark, if they do not support the problem.
        mesh: Element sizes.
        adapt: Tolerance to which `fem` shall know the markers, mm, for which the mesh is refined; None: not.
        material: The elastic constants; each solver takes the law that it has.
        load: What moves the finger.
        measurements: Marker displacements, their CSV file, or a film to track; None for a virtual experiment.
        truth: What the virtual experiment simulates; a key of `TRUTHS`.
        reference: Name of the solver that the others are compared with; `fem`, else the first, if None.
        out: Output folder.
        resume: Whether to take over solutions that an earlier run of the same job finished.
        picture_formats: Formats of the pictures besides PNG, of `FORMATS`.
        processes: Processes that may solve at a time; a second one takes the solvers of finite strain.
        options: Options of the command line that made the job, for `run.json`; empty from Python.
    """

    design: Finger
    solvers: Sequence[Solver]
    spare: Collection[str] = ()
    mesh: MeshSettings = field(default_factory=MeshSettings)
    adapt: float | None = None
    material: Material = field(default_factory=Material)
    load: Load = field(default_factory=Load)
    measurements: Observations | Path | Film | None = None
    truth: str = SLIDING.name
    reference: str | None = None
    out: Path = Path("out/default")
    resume: bool = False
    picture_formats: Sequence[str] = ()
    processes: int = 1
    options: Mapping[str, object] = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        """Names of the solvers."""
        return [solver.name for solver in self.solvers]


def checked(job: Job) -> Job:
    """The job with its measurements read, refused if it cannot be done, before anything is computed."""
    if not job.solvers:
        raise UserError("no solver was asked for; name at least one")
    for name in job.names:
        check_name(name)
    if len(set(job.names)) < len(job.names):
        raise UserError(f"a solver is named twice: {', '.join(job.names)}")
    if not job.load.values.any():
        raise UserError(
            "the load does not move the contact: there is nothing to compare; give a stroke in mm"
        )
    if job.adapt is not None:
        check_adaptable(job.adapt, job.load)
    if job.reference is not None and job.reference not in job.names:
        raise UserError(f"the reference {job.reference!r} is not among the solvers {', '.join(job.names)}")
    if job.resume and (typed := next((each for each in job.solvers if _source_file(each) is None), None)):
        raise UserError(
            f"solver {typed.name} has no source file, so that an edit of its class cannot be told; do not "
            "resume, or move the class from the notebook or shell into a module"
        )
    check_formats(job.picture_formats)
    check_truths([job.truth], job.design)
    check_walls(TRUTHS[job.truth])
    supported_solvers(job.solvers, job.spare, job.material, job.load)
    if isinstance(job.measurements, Path):
        radius = job.design.marker_radius
        return replace(job, measurements=read_measurements(job.measurements, marker_radius=radius))
    return job


def _source_file(solver: Solver) -> str | None:
    """File of the package or module that holds a solver's class; None where it was typed in."""
    return getattr(sys.modules.get(type(solver).__module__.partition(".")[0]), "__file__", None)

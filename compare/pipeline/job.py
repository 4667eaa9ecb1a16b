"""A comparison to make, and the checks that refuse an impossible one before anything is computed."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from pinnray.comparison.evaluation.comparison import Results, supported_solvers
from pinnray.comparison.evaluation.truths import SLIDING, TRUTHS, Truth, check_truths, check_walls
from pinnray.comparison.figures import Picture, check_formats, page_width
from pinnray.geometry.cache import mesh_sizes
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.finger.learned import Learned, check_target
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.observations import Observations
from pinnray.runtime.content_hash import has_source
from pinnray.runtime.errors import UserError
from pinnray.runtime.stages import Stages
from pinnray.solvers.fem.adaptive_refinement import check_adaptable
from pinnray.solvers.identification.settings import IdentifyingSolver
from pinnray.solvers.problem import Load, Material
from pinnray.solvers.solver import Solver, check_law, check_name
from pinnray.vision.measurements import read_measurements


@dataclass(frozen=True)
class Measured:
    """What a source of markers has measured, and how a report shows it."""

    observations: Observations
    warnings: Sequence[str]
    pictures: Sequence[Picture]  #: Of the source, such as annotated frames.
    compared: Callable[[Results], Sequence[Picture]]  #: Draws solutions into the source's pictures.


@runtime_checkable
class MarkerSource(Protocol):
    """Measures the markers when a run begins, such as a film that is tracked."""

    def measured(self, design: Finger, folder: Path, stages: Stages) -> Measured:
        """Measure the markers of a finger; files about it go into the output folder of the run."""

    def provenance(self) -> dict[str, Any]:
        """Names, settings and hashes of the source, for `run.json`."""


@dataclass(frozen=True)
class Job:
    """A comparison to make."""

    design: Finger
    solvers: Sequence[Solver] = ()  #: In the order of tables and pictures.
    spare: Collection[str] = ()  #: Names of solvers to leave out if they do not support the problem.
    #: Element sizes; None for the mesh of the finger's file if it has one, else the default sizes.
    mesh: MeshSettings | None = None
    adapt: float | None = None  #: Tolerance of `fem` at the markers, mm, for which the mesh is refined.
    material: Material = field(default_factory=Material)  #: Elastic constants; each solver has its own law.
    load: Load = field(default_factory=Load)  #: Motion of the indenter.
    #: Marker displacements, their CSV file, or a source such as a film; simulated if None.
    measurements: Observations | Path | MarkerSource | None = None
    weighed: tuple[float, float] | None = None  #: Force of the measurements by a scale, its deviation, N.
    presses: Sequence[Observations | Path] = ()  #: Other pictures of the finger, which `fem-id` learns from.
    learned: Learned | None = None  #: What earlier pictures have taught of the finger.
    learn: Path | None = None  #: Design file to write with what the pictures have taught.
    truth: str | None = None  #: Key of `TRUTHS` to simulate where nothing is measured; None: `sliding`.
    reference: str | None = None  #: Solver to compare the others with; `fem`, else the first, if None.
    out: Path = Path("out/default")  #: Output folder.
    resume: bool = False  #: Whether to take over the finished solutions of an earlier run.
    picture_formats: Sequence[str] = ()  #: Formats of the pictures besides PNG, of `FORMATS`.
    picture_width: float | None = None  #: Width of the pictures, mm; the usual one if None.
    options: Mapping[str, object] = field(default_factory=dict)  #: Of the command line, for `run.json`.

    def __post_init__(self) -> None:
        object.__setattr__(self, "mesh", mesh_sizes(self.design, self.mesh))

    @property
    def simulated(self) -> Truth:
        """The truth of a finger that is not measured."""
        return TRUTHS[SLIDING.name if self.truth is None else self.truth]

    @property
    def names(self) -> list[str]:
        """Names of the solvers."""
        return [solver.name for solver in self.solvers]


def prepared(job: Job) -> Job:
    """Refuse a job that no solver can do, and read its file of measurements; it may have no solvers yet.

    Raises:
        UserError: If the job cannot be done.
    """
    if not job.load.values.any():
        raise UserError(
            "the load does not move the contact: there is nothing to compare; give a stroke in mm"
        )
    if job.adapt is not None:
        check_adaptable(job.adapt, job.load)
    check_formats(job.picture_formats)
    page_width(job.picture_width)
    if job.truth is not None:
        if job.measurements is not None:
            raise UserError("a truth is for a simulated experiment; with measurements leave it out")
        check_truths([job.truth], job.design)
    check_walls(job.simulated)
    if (job.presses or job.learn is not None) and job.measurements is None:
        raise UserError("presses and learn are for a measured finger; give measurements, too")
    if job.learn is not None:
        check_target(job.learn)
    radius, measured = job.design.marker_radius, job.measurements
    if isinstance(measured, Path):
        measured = read_measurements(measured, marker_radius=radius)
    if job.weighed is not None:
        if not isinstance(measured, Observations):
            raise UserError(
                "a force was weighed with a picture whose markers are known: give their table, too"
            )
        measured = replace(measured, weighed=job.weighed)
    presses = [
        read_measurements(each, marker_radius=radius) if isinstance(each, Path) else each
        for each in job.presses
    ]
    return replace(job, measurements=measured, presses=presses)


def checked(job: Job) -> Job:
    """A `prepared` job whose solvers can do it.

    Raises:
        UserError: If the job cannot be done.
    """
    if not job.solvers:
        raise UserError("no solver was asked for; name at least one")
    for name in job.names:
        check_name(name)
    if len(set(job.names)) < len(job.names):
        raise UserError(f"a solver is named twice: {', '.join(job.names)}")
    job = prepared(job)
    if job.reference is not None and job.reference not in job.names:
        raise UserError(f"the reference {job.reference!r} is not among the solvers {', '.join(job.names)}")
    for solver in job.solvers if job.resume else ():
        if not has_source(type(solver).__module__):
            raise UserError(
                f"solver {solver.name} has no source file, so that an edit of its class cannot be told; do "
                "not resume, or move the class from the notebook or shell into a module"
            )
    if job.learn is not None and not any(isinstance(each, IdentifyingSolver) for each in job.solvers):
        raise UserError("learn takes what fem-id or pinn-id finds of the finger; name one of them")
    check_law(job.solvers, job.material)
    supported_solvers(job.solvers, job.spare, job.material, job.load)
    return job if job.measurements else replace(job, load=job.simulated.reached(job.load))

"""The main job: mesh, measure, solve, evaluate; then draw and write."""

import traceback
from collections import deque
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from compare.camera.film import Film
from compare.evaluation.branches import with_branches
from compare.evaluation.comparison import Comparison, supported_solvers
from compare.evaluation.convergence import with_certificates
from compare.evaluation.deformed_body import with_body_checks
from compare.evaluation.evaluation import Evaluation
from compare.evaluation.force_displacement import force_curves, write_force_displacement
from compare.evaluation.metrics import evaluated, pick_reference
from compare.evaluation.plausibility import check_positions, displacement_remarks, unit_remarks
from compare.evaluation.shared_mesh import shared_mesh, write_rounds
from compare.evaluation.truths import SLIDING, TRUTHS, check_truths, check_walls
from compare.evaluation.virtual_experiment import (
    UnfinishedExperimentError,
    no_displacements,
    virtual_experiment,
)
from compare.figures import Picture, check_formats, draw_all
from compare.report.html_report import write_report
from compare.report.metrics_json import metrics
from compare.report.tables import write_markers, write_summary, write_table_one
from compare.report.vtu_file import write_vtu
from compare.runtime.output_folder import (
    SOLUTIONS,
    TRAINING,
    check_output,
    replaced_folder,
    take_training,
    write_run,
)
from compare.runtime.provenance import package_versions, sources_digest
from compare.runtime.stages import Stages
from geometry.atomic import write_json, write_text
from geometry.content_hash import content_hash, file_digest
from geometry.errors import UserError
from geometry.finger.finger import Finger
from geometry.mesh.settings import MeshSettings
from geometry.observations import Observations
from solvers.adaptation import check_adaptable
from solvers.assimilation.misfit import assimilates
from solvers.problem import Load, Material, Problem
from solvers.shared_work import SharedWork
from solvers.solver import (
    Solver,
    SolverFailedError,
    TrainedSolver,
    TrainingContext,
    UnsupportedProblemError,
    check_name,
    solved,
    with_law,
)
from vision.frames.frame import Frame
from vision.measurements import read_measurements, write_measurements

TRACK = "track"
"""Folder of the files of the marker tracking."""
ERRORS = "errors"
"""Folder of the tracebacks of solvers that raised an exception."""


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
    options: Mapping[str, object] = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        """Names of the solvers."""
        return [solver.name for solver in self.solvers]


def run(job: Job, stages: Stages) -> Comparison:
    """Make the comparison and write its output folder.

    Raises:
        UserError: If the job cannot be done; the output folder is as it was.
    """
    job = checked(job)
    check_output(job.out)
    with replaced_folder(job.out, keep=job.names if job.resume else ()) as folder:
        photographs: list[Picture] = []
        tracked: Sequence[str] = ()
        measurements = job.measurements
        if isinstance(measurements, Film):
            # They need OpenCV.
            from compare.camera.predicted_frame import predicted_frame
            from compare.camera.track_film import track_figures, track_film

            last: deque[Frame] = deque(maxlen=1)
            with stages.stage("track") as progress:
                (folder / TRACK).mkdir()
                tracking, measurements = track_film(
                    measurements,
                    job.design,
                    folder / TRACK,
                    progress,
                    video=False,
                    watch=lambda frame, _: last.append(frame),
                )
            photographs, tracked = track_figures(folder / TRACK, tracking), tracking.warnings
        comparison = compute(replace(job, measurements=measurements), stages, folder)
        comparison = replace(comparison, warnings=[*tracked, *comparison.warnings])
        if photographs:
            photographs.append(predicted_frame(folder / TRACK, comparison, tracking, last[0].image))
        write(folder, job, comparison, stages, photographs=photographs)
    return comparison


def checked(job: Job) -> Job:
    """The job with its measurements read, refused if it cannot be done, before anything is computed."""
    if not job.solvers:
        raise UserError("no solver was asked for; name at least one")
    for name in job.names:
        check_name(name)
    if len(set(job.names)) < len(job.names):
        raise UserError(f"a solver is named twice: {', '.join(job.names)}")
    if job.adapt is not None:
        check_adaptable(job.adapt, job.load)
    if job.reference is not None and job.reference not in job.names:
        raise UserError(f"the reference {job.reference!r} is not among the solvers {', '.join(job.names)}")
    check_formats(job.picture_formats)
    check_truths([job.truth], job.design)
    check_walls(TRUTHS[job.truth])
    supported_solvers(job.solvers, job.spare, job.material, job.load)
    if isinstance(job.measurements, Path):
        radius = job.design.marker_radius
        return replace(job, measurements=read_measurements(job.measurements, marker_radius=radius))
    return job


def compute(job: Job, stages: Stages, folder: Path) -> Comparison:
    """Mesh, solve and evaluate, without pictures and report.

    Args:
        job: Checked, with its film tracked.
        stages: Told of the progress.
        folder: For solutions and checkpoints as they are finished, from which a resumed run goes on.

    Raises:
        UserError: If the mesh, the virtual experiment or a solver refuses.
    """
    given = job.measurements if isinstance(job.measurements, Observations) else None
    solvers, left_out = supported_solvers(job.solvers, job.spare, job.material, job.load)
    mesh, adaptation = shared_mesh(
        job.design,
        job.mesh,
        stages,
        tolerance=job.adapt,
        material=job.material,
        load=job.load,
        solvers=solvers,
        check=partial(check_positions, given) if given else None,
    )
    problem = Problem(mesh, job.material, job.load, finger=job.design)
    with stages.stage("measurements") as progress:
        observations, truth, remarks = given, None, displacement_remarks(given, problem) if given else []
        if observations is None:
            radius = job.design.marker_radius
            try:
                observations, truth = virtual_experiment(problem, radius, progress, TRUTHS[job.truth])
            except UnfinishedExperimentError as error:
                solvers, without = _without_markers(solvers, job.spare, error)
                left_out |= without
                observations, remarks = no_displacements(problem, radius, str(error)), [f"no truth: {error}"]
    evaluations: list[Evaluation] = []
    settings: dict[str, dict[str, object]] = {}
    failed: dict[str, str] = {}
    fault: SolverFailedError | None = None
    work = SharedWork()
    for solver in solvers:
        trained = _in_context(solver, job, folder, evaluations)
        try:
            with work.used():
                evaluations.append(_evaluate(job, trained, problem, observations, folder, stages))
            settings[solver.name] = solver.settings()
        except UnsupportedProblemError as error:
            if solver.name not in job.spare:
                raise
            left_out[solver.name] = str(error)
        except SolverFailedError as error:
            if solver.name == job.reference:
                raise
            (folder / ERRORS).mkdir(exist_ok=True)
            trace = folder / ERRORS / f"{solver.name}.txt"
            write_text(trace, "".join(traceback.format_exception(error.__cause__)))
            failed[solver.name] = f"{error}; its traceback is in {trace.relative_to(folder)}"
            fault = error
    if fault is not None and not evaluations:
        raise fault
    with stages.stage("certificate"):
        evaluations = with_certificates(evaluations, problem)
        evaluations, impossible = with_body_checks(evaluations, mesh, truth)
        evaluations, branches = with_branches(evaluations, problem)
    return Comparison(
        design=job.design,
        mesh=mesh,
        observations=observations,
        evaluations=evaluations,
        reference=pick_reference(evaluations, job.reference),
        material=job.material,
        load=job.load,
        truth=truth,
        adaptation=adaptation,
        settings=settings,
        left_out=left_out,
        failed=failed,
        warnings=[*unit_remarks(problem), *remarks, *impossible, *branches],
    )


def _without_markers(
    solvers: Sequence[Solver], spare: Collection[str], error: UserError
) -> tuple[list[Solver], dict[str, str]]:
    """The solvers that need no markers, and by name why others are left out.

    Raises:
        UserError: The given one, if a solver that needs markers is not spare, or all need them.
    """
    chosen = [solver for solver in solvers if not assimilates(solver)]
    needing = [solver.name for solver in solvers if assimilates(solver)]
    if not chosen or not set(needing) <= set(spare):
        raise error
    return chosen, dict.fromkeys(needing, "no markers to assimilate")


def write(
    folder: Path,
    job: Job,
    comparison: Comparison,
    stages: Stages,
    *,
    photographs: Sequence[Picture] = (),
) -> None:
    """Write every file of a comparison but its solutions, which `compute` has written.

    Args:
        folder: Where to write.
        job: What was asked for.
        comparison: What was found.
        stages: Told of the progress.
        photographs: Pictures of the marker tracking, for the report.
    """
    if comparison.adaptation is not None:
        write_rounds(folder / "adapt.csv", comparison.adaptation)
    write_measurements(folder / "observations.csv", comparison.observations)
    with stages.stage("pictures") as progress:
        pictures = draw_all(folder / "figures", comparison, progress, job.picture_formats)
    with stages.stage("report"), SharedWork().used():
        for evaluation in comparison.shown_fields:
            write_vtu(folder / "fields" / f"{evaluation.solver}.vtu", comparison.mesh, evaluation)
        write_markers(folder / "markers.csv", comparison)
        write_table_one(folder / "table1.csv", comparison)
        write_summary(folder / "summary.csv", comparison)
        if curves := force_curves(comparison.evaluations, job.load):
            write_force_displacement(
                folder / "force_displacement.csv", curves, job.load, depth=job.design.depth
            )
        numbers = metrics(comparison)
        write_json(folder / "metrics.json", numbers)
        provenance = _provenance(folder, job, comparison, stages)
        write_report(folder / "report.html", comparison, [*pictures, *photographs], provenance, numbers)
        write_run(folder, provenance)


def _provenance(folder: Path, job: Job, comparison: Comparison, stages: Stages) -> dict[str, Any]:
    """Times, and what the numbers depend on: hashes, settings, seeds, devices, versions, machine."""
    adaptation, settings = comparison.adaptation, comparison.settings
    return {
        **stages.record(),
        "options": dict(job.options),
        "design_sha256": job.design.digest,
        "mesh_sha256": comparison.mesh.digest,
        "problem_sha256": Problem(comparison.mesh, job.material, job.load).digest,
        "mesh": job.mesh.model_dump(),
        "adapt": adaptation and {"tolerance_mm": adaptation.tolerance, "end": adaptation.message},
        "material": job.material.model_dump(),
        "load": job.load.model_dump(),
        "measurements_sha256": file_digest(folder / "observations.csv"),
        "film": job.measurements.provenance() if isinstance(job.measurements, Film) else None,
        "solvers": settings,
        "left_out": comparison.left_out,
        "failed": comparison.failed,
        "seed": {name: own["seed"] for name, own in settings.items() if "seed" in own},
        "device": {each.solver: each.stats.get("device", "cpu") for each in comparison.evaluations},
        "versions": package_versions(),
    }


def _in_context(solver: Solver, job: Job, folder: Path, finished: Sequence[Evaluation]) -> Solver:
    """The solver, told where to save its training and the energy of `fem`, if it takes that."""
    if not isinstance(solver, TrainedSolver):
        return solver
    checkpoints = folder / TRAINING / solver.name
    if job.resume and not checkpoints.exists():
        take_training(solver.name, job.out, folder)
    law = with_law(job.material, solver).law
    energies = [entry.energy for entry in finished if (entry.solver, entry.law) == ("fem", law)]
    reference = energies[0] if energies else None
    return solver.in_context(TrainingContext(checkpoints, job.resume, reference))


def _evaluate(
    job: Job, solver: Solver, problem: Problem, observations: Observations, folder: Path, stages: Stages
) -> Evaluation:
    """Solve and sample, or take over what an earlier run finished."""
    given = observations if assimilates(solver) else None
    own = replace(problem, material=with_law(job.material, solver), observations=given)
    key = _key(solver, own, observations)
    kept = folder / SOLUTIONS / f"{solver.name}.npz"
    with stages.stage(solver.name) as progress:
        if job.resume:
            for place in (folder, job.out):
                if (evaluation := Evaluation.load(place / SOLUTIONS / kept.name, key)) is not None:
                    progress(1.0, "taken over from an earlier run")
                    evaluation.save(kept, key)
                    take_training(solver.name, place, folder)
                    return evaluation
        solution = solved(solver, own, progress)
        # A solver that hands its work to another one may return the other's name.
        solution = replace(solution, solver=solver.name)
        evaluation = evaluated(solution, problem.mesh, observations.points)
        evaluation.save(kept, key)
    return evaluation


def _key(solver: Solver, problem: Problem, observations: Observations) -> str:
    """SHA-256 over everything that a solution's samples depend on, the solver's own sources included."""
    package = type(solver).__module__.partition(".")[0]
    parts = [
        solver.name,
        solver.settings(),
        package_versions(),
        sources_digest(["compare.evaluation.evaluation", "geometry", "solvers", package]),
        problem.digest,
        observations.points,
    ]
    return content_hash(parts)

"""The main job: mesh, measure, solve, evaluate, draw, report."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from compare.camera.film import Film
from compare.evaluation.convergence import with_certificates
from compare.evaluation.evaluation import Evaluation
from compare.evaluation.force_displacement import force_curves, write_force_displacement
from compare.evaluation.metrics import pick_reference
from compare.evaluation.shared_mesh import check_inside, shared_mesh, write_rounds
from compare.evaluation.solver_selection import left_out_remarks, supported_solvers
from compare.evaluation.uncertainty import evaluated
from compare.evaluation.virtual_experiment import virtual_experiment
from compare.figures import Figure, draw_all
from compare.report.html_report import ReportContent, write_report
from compare.report.metrics_json import metrics
from compare.report.table_one import write_table_one
from compare.report.tables import write_markers, write_summary
from compare.report.vtu_file import write_vtu
from compare.runtime.output_folder import (
    SOLUTIONS,
    TRAINING,
    check_output,
    replaced_folder,
    take_training,
    write_run,
)
from compare.runtime.provenance import file_digest, machine, package_versions, sources_digest
from compare.runtime.stages import Stages
from geometry.atomic import write_json
from geometry.content_hash import content_hash
from geometry.errors import UserError
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from geometry.observations import Observations
from solvers.adaptation import Adaptation, check_adaptable
from solvers.assimilation.misfit import assimilates
from solvers.problem import Load, Material, Problem
from solvers.solver import Solver, UnsupportedProblemError, with_law
from solvers.training import TrainedSolver, TrainingContext
from vision.measurements import read_measurements, write_measurements

TRACK = "track"
"""Folder of what tracking a film wrote."""


@dataclass(frozen=True)
class Job:
    """What to compare.

    Attributes:
        design: The finger.
        solvers: The solvers, in the order of tables and pictures.
        spare: Names of those that are left out, with a remark, if they cannot do the job.
        mesh: Element sizes.
        adapt: Tolerance to which `fem` shall know the markers, mm, for which the mesh is refined; None: not.
        material: The elastic constants; each solver takes the law that it has.
        load: What moves the finger.
        measurements: CSV file of marker displacements, or a film to track; None for a virtual experiment.
        reference: Name of the solver that the others are compared with; `fem`, else the first, if None.
        out: Output folder.
        resume: Whether to take over solutions that an earlier run of the same job finished.
    """

    design: Design
    solvers: Sequence[Solver]
    spare: Collection[str] = ()
    mesh: MeshSettings = field(default_factory=MeshSettings)
    adapt: float | None = None
    material: Material = field(default_factory=Material)
    load: Load = field(default_factory=Load)
    measurements: Path | Film | None = None
    reference: str | None = None
    out: Path = Path("out/default")
    resume: bool = False


@dataclass(frozen=True, eq=False)
class Outcome:
    """A finished comparison; its files are in the job's output folder.

    Attributes:
        metrics: The content of `metrics.json`.
        evaluations: One for each solver.
        observations: What they were compared with.
        reference: One of the evaluations.
        adaptation: How the mesh was refined, if that was asked for.
        truth: The fields of the virtual experiment, if the markers are simulated.
        remarks: Which solvers were left out and why, and what tracking a film had to say.
    """

    metrics: dict[str, Any]
    evaluations: Sequence[Evaluation]
    observations: Observations
    reference: Evaluation
    adaptation: Adaptation | None = None
    truth: Evaluation | None = None
    remarks: Sequence[str] = ()


def run(job: Job, stages: Stages) -> Outcome:
    """Run the comparison and write its output folder.

    Raises:
        UserError: If the job cannot be done; the output folder is as it was.
    """
    started = datetime.now(UTC)
    _check(job)
    chosen, left_out = supported_solvers(job.solvers, job.spare, job.material, job.load)
    radius = job.design.marker_radius
    given = None
    if isinstance(job.measurements, Path):
        given = read_measurements(job.measurements, marker_radius=radius)
    shots: list[Figure] = []
    remarks: Sequence[str] = ()
    with replaced_folder(job.out, keep=_names(job) if job.resume else ()) as folder:
        if isinstance(job.measurements, Film):
            from compare.camera.track_film import track_figures, track_film  # needs OpenCV

            with stages.stage("track") as progress:
                (folder / TRACK).mkdir()
                tracking, given = track_film(
                    job.measurements, job.design, folder / TRACK, progress, video=False
                )
            shots, remarks = track_figures(folder / TRACK, tracking), tracking.warnings
        mesh, adaptation = shared_mesh(
            job.design,
            job.mesh,
            stages,
            tolerance=job.adapt,
            material=job.material,
            load=job.load,
            solvers=chosen,
            check=partial(check_inside, given) if given else None,
        )
        if adaptation is not None:
            write_rounds(folder / "adapt.csv", adaptation)
        problem = Problem(mesh, job.material, job.load)
        with stages.stage("measurements") as progress:
            observations, truth = (given, None) if given else virtual_experiment(problem, radius, progress)
            write_measurements(folder / "observations.csv", observations)
        evaluations: list[Evaluation] = []
        for solver in chosen:
            known = _in_context(solver, job, folder, evaluations)
            try:
                evaluations.append(_evaluate(job, known, problem, observations, folder, stages))
            except UnsupportedProblemError as error:
                if solver.name not in job.spare:
                    raise
                left_out[solver.name] = str(error)
        with stages.stage("certificate"):
            evaluations = with_certificates(evaluations, problem)
        reference = pick_reference(evaluations, job.reference)
        with stages.stage("pictures") as progress:
            figures = draw_all(
                folder / "figures",
                design=job.design,
                mesh=mesh,
                load=job.load,
                evaluations=evaluations,
                observations=observations,
                reference=reference,
                progress=progress,
            )
        with stages.stage("report"):
            for evaluation in evaluations:
                write_vtu(folder / "fields" / f"{evaluation.solver}.vtu", mesh, evaluation)
            write_markers(folder / "markers.csv", evaluations=evaluations, observations=observations)
            write_table_one(folder / "table1.csv", evaluations=evaluations, observations=observations)
            write_summary(
                folder / "summary.csv",
                evaluations=evaluations,
                observations=observations,
                reference=reference,
                truth=truth,
            )
            if curves := force_curves(evaluations, job.load):
                write_force_displacement(
                    folder / "force_displacement.csv", curves, job.load, depth=job.design.depth
                )
            numbers = metrics(
                design=job.design,
                material=job.material,
                load=job.load,
                observations=observations,
                evaluations=evaluations,
                reference=reference,
                truth=truth,
            )
            write_json(folder / "metrics.json", numbers)
            provenance = {
                "started": started.isoformat(timespec="seconds"),
                "seconds": {name: round(seconds, 2) for name, seconds in stages.seconds.items()},
                "design_sha256": job.design.digest,
                "mesh_sha256": mesh.digest,
                "problem_sha256": problem.digest,
                "mesh": job.mesh.model_dump(),
                "adapt": adaptation and {"tolerance_mm": adaptation.tolerance, "end": adaptation.message},
                "material": job.material.model_dump(),
                "load": job.load.model_dump(),
                "measurements_sha256": file_digest(folder / "observations.csv"),
                "film": job.measurements.provenance() if isinstance(job.measurements, Film) else None,
                "solvers": {
                    solver.name: solver.settings() for solver in chosen if solver.name not in left_out
                },
                "left_out": left_out,
                "seed": {
                    solver.name: solver.settings()["seed"] for solver in chosen if "seed" in solver.settings()
                },
                "device": {
                    evaluation.solver: evaluation.stats.get("device", "cpu") for evaluation in evaluations
                },
                "versions": package_versions(),
                "machine": machine(),
            }
            write_report(
                folder / "report.html",
                ReportContent(
                    design=job.design,
                    material=job.material,
                    load=job.load,
                    mesh=mesh,
                    observations=observations,
                    evaluations=evaluations,
                    reference=reference,
                    figures=[*figures, *shots],
                    provenance=provenance,
                    adaptation=adaptation,
                    left_out=left_out_remarks(left_out),
                    truth=truth,
                ),
            )
            write_run(folder, provenance)
    remarks = [*left_out_remarks(left_out), *remarks]
    return Outcome(numbers, evaluations, observations, reference, adaptation, truth, remarks)


def _check(job: Job) -> None:
    """Refuse what cannot be done before anything is computed."""
    if not job.solvers:
        raise UserError("no solver was asked for; name at least one")
    names = _names(job)
    if len(set(names)) < len(names):
        raise UserError(f"a solver is named twice: {', '.join(names)}")
    if job.adapt is not None:
        check_adaptable(job.adapt, job.load)
    if job.reference is not None and job.reference not in names:
        raise UserError(f"the reference {job.reference!r} is not among the solvers {', '.join(names)}")
    check_output(job.out)


def _names(job: Job) -> list[str]:
    return [solver.name for solver in job.solvers]


def _in_context(solver: Solver, job: Job, folder: Path, finished: Sequence[Evaluation]) -> Solver:
    """The solver, told where to save its training and what is known, if it is one that asks."""
    if not isinstance(solver, TrainedSolver):
        return solver
    left = folder / TRAINING / solver.name
    if job.resume and not left.exists():
        take_training(solver.name, job.out, folder)
    law = with_law(job.material, solver).law
    energies = [entry.energy for entry in finished if (entry.solver, entry.law) == ("fem", law)]
    context = TrainingContext(
        folder=left,
        resume=job.resume,
        reference_energy=energies[0] if energies else None,
    )
    return solver.in_context(context)


def _evaluate(
    job: Job, solver: Solver, problem: Problem, observations: Observations, folder: Path, stages: Stages
) -> Evaluation:
    """Solve and sample, or take over what an earlier run finished."""
    given = observations if assimilates(solver) else None
    own = Problem(problem.mesh, with_law(job.material, solver), job.load, given)
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
        try:
            solution = solver.solve(own, progress)
        except Exception as error:  # its own fault goes on, with a word on what is left
            error.add_note(
                f"solver {solver.name} failed; run again with --resume and without it for the rest"
            )
            raise
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

"""The main job: mesh, measure, solve, evaluate; then draw and write."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pinnray.comparison.evaluation.comparison import Results, pick_reference, supported_solvers
from pinnray.comparison.evaluation.deformed_body import with_body_checks
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.evaluation.force_curves import force_curves, write_force_displacement
from pinnray.comparison.evaluation.plausibility import check_positions, displacement_remarks, problem_remarks
from pinnray.comparison.evaluation.virtual_experiment import (
    UnfinishedExperimentError,
    no_displacements,
    virtual_experiment,
)
from pinnray.comparison.figures import Picture, draw_all
from pinnray.comparison.pipeline.job import Job, MarkerSource, checked
from pinnray.comparison.pipeline.shared_mesh import shared_mesh
from pinnray.comparison.pipeline.solving import ERRORS, solve_all
from pinnray.comparison.report.comparison import Comparison
from pinnray.comparison.report.tables import write_markers, write_summary, write_table_one
from pinnray.geometry.drawing.drawn_finger import finger_lines
from pinnray.geometry.finger.learned import write_learned
from pinnray.geometry.observations import Observations
from pinnray.runtime.atomic import write_text
from pinnray.runtime.content_hash import file_digest
from pinnray.runtime.errors import UserError
from pinnray.runtime.machine import package_versions
from pinnray.runtime.output_folder import check_output, replaced_folder, write_run
from pinnray.runtime.processes.pool import Pool
from pinnray.runtime.stages import Stages
from pinnray.solvers.identification.settings import taught
from pinnray.solvers.problem import Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solver import Solver, Traits
from pinnray.vision.measurements import write_measurements

TRUTH_IS_STRAIGHT = (
    "the simulated finger is pressed along y, by the stroke's part along y, and not along the inclined "
    "stroke: errors from it are also those of another load; take measurements"
)


def run(job: Job, stages: Stages, pool: Pool | None = None) -> Comparison:
    """Make the comparison and write its output folder.

    Args:
        job: What to compare.
        stages: Is told what is done.
        pool: A second process, which solves beside this one.

    Raises:
        UserError: If the job cannot be done; the output folder is as it was.
    """
    job = checked(job)
    check_output(job.out)
    kept = job.names if job.resume else ()
    with replaced_folder(job.out, keep=kept) as folder:
        given, measured, photographs = job, None, list[Picture]()
        if isinstance(job.measurements, MarkerSource):
            measured = job.measurements.measured(job.design, folder, stages)
            given = replace(job, measurements=measured.observations)
        comparison = _with_files(compute(given, stages, folder, pool))
        if measured is not None:
            comparison = replace(comparison, warnings=[*measured.warnings, *comparison.warnings])
            photographs = [*measured.pictures, *measured.compared(comparison)]
        _write(folder, job, comparison, stages, photographs)
    return comparison


def compute(job: Job, stages: Stages, folder: Path, pool: Pool | None = None) -> Comparison:
    """Mesh, solve and evaluate a checked job whose markers are known or simulated.

    Solutions and checkpoints go into the folder.

    Raises:
        UserError: If the mesh, the virtual experiment or a solver refuses.
    """
    given = job.measurements if isinstance(job.measurements, Observations) else None
    solvers, unsupported = supported_solvers(job.solvers, job.spare, job.material, job.load)
    mesh, adaptation = shared_mesh(job, solvers, stages)
    learned = job.learned if given else None  # a simulated finger is as it is drawn
    problem = Problem(mesh, job.material, job.load, finger=job.design, learned=learned)
    if presses := [each for each in job.presses if isinstance(each, Observations)]:
        with stages.stage("presses") as progress:
            for each in presses:
                check_positions(each, mesh)
            problem = replace(problem, learned=taught(make_solver("fem-id"), problem, presses, progress))
    with stages.stage("measurements") as progress:
        observations, truth, remarks = given, None, displacement_remarks(given, problem) if given else []
        if observations is None:
            radius = job.design.marker_radius
            try:
                observations, truth = virtual_experiment(problem, radius, progress, job.simulated)
                remarks += [TRUTH_IS_STRAIGHT] if job.load.displacement[0] else []
            except UnfinishedExperimentError as error:
                solvers, without = _without_markers(solvers, job.spare, error)
                unsupported |= without
                observations, remarks = no_displacements(problem, radius, str(error)), [f"no truth: {error}"]
    outcome = solve_all(job, solvers, problem, observations, folder, stages, pool)
    if outcome.unsupported and not (outcome.evaluations or outcome.failed):
        raise UserError("; ".join(outcome.unsupported.values()))
    with stages.stage("checks"):
        evaluations, impossible = with_body_checks(list(outcome.evaluations.values()), mesh, truth)
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
        settings={each.name: each.settings() for each in solvers if each.name in outcome.evaluations},
        unsupported=unsupported | outcome.unsupported,
        failed=outcome.failed,
        tracebacks={
            name: file.read_text(encoding="utf-8")
            for name in outcome.failed
            if (file := folder / ERRORS / f"{name}.txt").exists()
        },
        warnings=[
            *(f"{each.solver}: {text}" for each in evaluations for text in each.warnings),
            *(*problem_remarks(problem), *remarks, *_unframed(evaluations, observations)),
            *impossible,
        ],
    )


def _unframed(evaluations: Sequence[Evaluation], observations: Observations) -> list[str]:
    """A remark on solvers that were given pictures whose frames are unknown, and took them as they are."""
    known = observations.pressed.fixed and observations.drawn.fixed
    names = [each.solver for each in evaluations if each.in_sample and each.shown is None]
    if known or not names:
        return []
    return [f"{', '.join(names)}: the pictures' frames are not known, and were taken as they are"]


def _with_files(comparison: Comparison) -> Comparison:
    """A comparison whose reasons for a failure name the file of the traceback."""
    files = {name: f"; its traceback is in {Path(ERRORS) / name}.txt" for name in comparison.tracebacks}
    failed = {name: reason + files.get(name, "") for name, reason in comparison.failed.items()}
    return replace(comparison, failed=failed)


def _without_markers(
    solvers: Sequence[Solver], spare: Collection[str], error: UserError
) -> tuple[list[Solver], dict[str, str]]:
    """The solvers that need no markers, and reasons why others are left out, by name.

    Raises:
        UserError: The given one, if a solver that needs markers is not spare, or all need them.
    """
    chosen = [solver for solver in solvers if not Traits.of(solver).assimilates]
    needing = [solver.name for solver in solvers if Traits.of(solver).assimilates]
    if not chosen or not set(needing) <= set(spare):
        raise error
    return chosen, dict.fromkeys(needing, "no markers to assimilate")


def _write(
    folder: Path, job: Job, comparison: Results, stages: Stages, photographs: Sequence[Picture] = ()
) -> None:
    """Write every file of a comparison but its solutions; photographs are for the report."""
    # They need the libraries of pictures.
    from pinnray.comparison.report.html_report import report_html
    from pinnray.comparison.report.output_files import write_vtu

    write_measurements(folder / "observations.csv", comparison.observations)
    comparison.scores.write(folder)
    converged = [each.identified for each in comparison.evaluations if each.converged]
    learned = [own.learned for own in converged if own and own.learned]
    if job.learn is not None and learned:
        write_learned(job.learn, learned[0], finger_lines(job.design))
    with stages.stage("fields"):
        for evaluation in comparison.shown_fields:
            write_vtu(folder / "fields" / f"{evaluation.solver}.vtu", comparison.mesh, evaluation)
    with stages.stage("tables"):
        write_markers(folder / "markers.csv", comparison)
        write_table_one(folder / "table1.csv", comparison)
        write_summary(folder / "summary.csv", comparison)
        if curves := force_curves(comparison.evaluations, job.load):
            write_force_displacement(folder / "force_displacement.csv", curves, depth=job.design.depth)
    with stages.stage("pictures") as progress:
        figures = folder / "figures"
        pictures = draw_all(figures, comparison, progress, job.picture_formats, job.picture_width)
    with stages.stage("report"):
        record = _provenance(folder, job, comparison, stages)
        write_text(folder / "report.html", report_html(comparison, [*pictures, *photographs], record))
        write_run(folder, record)


def _provenance(folder: Path, job: Job, comparison: Results, stages: Stages) -> dict[str, Any]:
    """Times, and the causes of the numbers: hashes, settings, seeds, devices, versions, machine."""
    adaptation, settings = comparison.adaptation, comparison.settings
    return {
        **stages.record(),
        "options": dict(job.options),
        "design_sha256": job.design.digest,
        "mesh_sha256": comparison.mesh.digest,
        "problem_sha256": Problem(comparison.mesh, job.material, job.load).digest,
        "mesh": job.mesh and job.mesh.model_dump(),
        "adapt": adaptation and {"tolerance_mm": adaptation.tolerance, "end": adaptation.message},
        "material": job.material.model_dump(),
        "load": job.load.model_dump(),
        "learned": job.learned and job.learned.model_dump(),
        "measurements_sha256": file_digest(folder / "observations.csv"),
        "film": job.measurements.provenance() if isinstance(job.measurements, MarkerSource) else None,
        "solvers": settings,
        "left_out": comparison.unsupported,
        "failed": comparison.failed,
        "seed": {name: own["seed"] for name, own in settings.items() if "seed" in own},
        "device": {each.solver: each.stats.get("device", "cpu") for each in comparison.evaluations},
        "versions": package_versions(),
    }

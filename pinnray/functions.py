"""Functions of the front door: mesh, solve, compare, cross-validate.

Parameters of the finger, the material and the indenter's stroke are keywords of each, with the names of the
[tables of parameters](../parameters.md): `solve("default", rib_count=6, young=5, stroke=8)`.
"""

import warnings
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from pinnray.arguments import (
    given_drawing,
    learned_of,
    mesh_settings,
    read_job,
    read_solver,
    read_solvers,
    taken,
)
from pinnray.camera import read_observations
from pinnray.comparison.report.comparison import Comparison
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.drawing.drawn_finger import DrawnFinger
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.finger.learned import Learned
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.runtime.errors import UserError
from pinnray.runtime.text_files import as_path, output_folder
from pinnray.solution import Solution
from pinnray.solvers.identification.settings import taught
from pinnray.solvers.load import Load, LoadKind
from pinnray.solvers.material import Material
from pinnray.solvers.problem import Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solver import Solver, Traits, check_asked, solved, with_law

if TYPE_CHECKING:
    import pandas as pd

    from pinnray.studies.benchmark.benchmark import Benchmark
    from pinnray.studies.crossval.result import CrossvalResult


def mesh(design: str | Path | Finger = "default", **given: Any) -> TriangleMesh:
    """The mesh of a finger, from the cache if it was made before: `mesh(size=0.5, rib_count=6)`.

    Args:
        design: A finger, the name of a preset, or the path of a TOML file or of a drawing.
        given: Settings of `pinnray.geometry.mesh.settings.MeshSettings`, mm, and parameters of the finger.

    Raises:
        UserError: If the design or a setting is not admissible.
    """
    settings = taken(given, MeshSettings)
    finger, _, _ = read_job(design, None, None, given, besides=tuple(MeshSettings.model_fields), allowed=())
    return finger_mesh(finger, settings=MeshSettings(**settings) if settings else None)


def load_drawing(file: str | Path, **description: Any) -> DrawnFinger:
    """The finger of a STEP, DXF or SVG drawing or of a Gmsh mesh.

    Args:
        file: The drawing. A TOML file of the same name beside it may hold its description.
        description: Lines of the description that are new or other: `clamp`, `contact`, `markers`, `depth`,
            `units` and so on, as in `pinnray.geometry.drawing.description.Description`.

    Raises:
        UserError: If the drawing cannot be read, is no sound section, or the description does not fit it.
    """
    return given_drawing(file, description)


def solver(name: str = "", **settings: Any) -> Solver:
    """A solver by its name, with its defaults for the settings that are not given.

    Args:
        name: One of `solver_names()`.
        settings: Of the solver, such as `preset="trained"` of `pinn-std`.

    Raises:
        UserError: If there is no such solver or setting, or a library that it needs is missing.
    """
    return make_solver(name, **settings)


def solve(
    problem: str | Path | Finger | Problem = "default",
    solver: str | Solver | None = None,
    *,
    preset: str | None = None,
    size: float | MeshSettings | None = None,
    material: Material | str | None = None,
    load: Load | LoadKind | None = None,
    measurements: "str | Path | Observations | pd.DataFrame | None" = None,
    presses: "Sequence[str | Path | Observations | pd.DataFrame]" = (),
    learned: Learned | None = None,
    progress: bool | None = None,
    **given: Any,
) -> Solution:
    """Solve a problem, or a design with the usual material and load, with one solver.

    Warns of numbers that look like another unit, of unlikely measurements, of a solver that is to fit markers
    and has none, of a result that did not converge, by itself or by its certificate, and of a body that is
    turned inside out or goes through itself; the solution's status has these faults, too.

    Args:
        problem: A problem, or a design in one of the ways of `mesh`.
        solver: A solver or its name, which takes the material law that it has unless one is given; if None
            `fem`, or with a preset `pinn-std`.
        preset: Of a network: `fast`, `local`, `paper` or `trained`.
        size: Largest element in walls and ribs, mm, or `MeshSettings`; as the next arguments, for a design
            only.
        material: The elastic constants, unless `young` and others are given, or a name of
            `pr.MATERIALS`.
        load: Motion of the indenter, or its kind alone.
        measurements: Marker displacements, for a solver that assimilates them.
        presses: Other pictures of the same finger under the same contact, from which a solver that
            identifies the finger learns before; `solution.identified.learned` has what all have taught.
        learned: What earlier pictures have taught of the finger; that of the design's file if None.
        progress: Whether to show the stages; if None in a notebook only.
        given: Parameters of the finger (`rib_count`), the material (`young` or E, `poisson` or nu, `plane`,
            `law`) and the load (`stroke`, mm, `direction`, degrees, `slide`, `radius`, mm, `friction`).

    Raises:
        UserError: If the solver does not support the problem, the law or measurements, or these cannot be of
            the finger.
    """
    from pinnray.comparison.evaluation.certifier import with_certificates
    from pinnray.comparison.evaluation.deformed_body import DeformedBody
    from pinnray.comparison.evaluation.evaluation import Evaluation
    from pinnray.comparison.evaluation.plausibility import (
        check_positions,
        displacement_remarks,
        problem_remarks,
    )
    from pinnray.runtime.stages import shown_stages

    chosen = read_solver(solver, preset)
    others = (size, material, load, measurements, presses or None, learned)
    with shown_stages(progress) as stages:
        if not isinstance(problem, Problem):
            words = ("size", "material", "load", "measurements", "presses", "learned", "preset", "solver")
            finger, elastic, moved = read_job(problem, material, load, given, besides=words)
            seen = read_observations(measurements, finger)
            check_asked(chosen, elastic, seen)
            with stages.stage("mesh"):
                triangles = finger_mesh(finger, settings=mesh_settings(size))
                if seen is not None:
                    check_positions(seen, triangles)
            known = learned_of(problem) if learned is None else learned
            problem = Problem(triangles, with_law(elastic, chosen), moved, seen, finger, known)
            if presses:
                with stages.stage("presses") as report:
                    pictures = [found for each in presses if (found := read_observations(each, finger))]
                    problem = replace(problem, learned=taught(chosen, problem, pictures, report))
        elif given or any(each is not None for each in others):
            raise UserError(
                "a Problem has its own mesh, material, load and observations; give a design to choose them"
            )
        else:
            check_asked(chosen, problem.material, problem.observations)
            if problem.observations is not None:
                check_positions(problem.observations, problem.mesh)
        problem = replace(problem, material=with_law(problem.material, chosen))
        remarks = [] if problem.finger is None else problem_remarks(problem)  # a closed form has any unit
        if (seen := problem.observations) is not None:
            remarks += displacement_remarks(seen, problem)
        with stages.stage(chosen.name) as report:
            solution = solved(chosen, problem, report)
        with stages.stage("certificate"):
            (judged,) = with_certificates([Evaluation.of(solution, problem.mesh)], problem)
    if seen is None and Traits.of(chosen).assimilates:
        said = solution.status.message
        remarks.append(f"{chosen.name} fits markers, and no measurements were given: {said}")
    certified = replace(solution.status, converged=judged.converged, message=judged.message)
    status, faults = DeformedBody(problem.mesh).status(replace(solution, status=certified))
    if not status.converged:
        remarks.append(f"{chosen.name} did not converge: {status.message}")
    for remark in [*status.warnings, *remarks, *faults]:
        warnings.warn(remark, stacklevel=2)
    return Solution.of(solution, status=status)


def compare(
    design: str | Path | Finger = "default",
    solvers: str | Sequence[str | Solver] | None = None,
    *,
    preset: str | None = None,
    measurements: "str | Path | Observations | pd.DataFrame | None" = None,
    presses: "Sequence[str | Path | Observations | pd.DataFrame]" = (),
    learned: Learned | None = None,
    learn: str | Path | None = None,
    truth: str | None = None,
    size: float | MeshSettings | None = None,
    adapt: float | None = None,
    material: Material | str | None = None,
    load: Load | LoadKind | None = None,
    reference: str | None = None,
    out: str | Path | None = None,
    resume: bool = False,
    progress: bool | None = None,
    **given: Any,
) -> Comparison:
    """Solve one finger with several solvers and compare them at the markers and on the shared mesh.

    Warns of what the command line says, such as a solver that raises: it has a row with the reason in
    `table()`, and the result has its traceback in `tracebacks`.

    Args:
        design: A finger, the name of a preset, or the path of a TOML file or of a drawing.
        solvers: Solvers or their names; those of the complete table that support the problem if None.
        preset: Of the networks among them: `fast`, `local`, `paper` or `trained`.
        measurements: Marker displacements: a data frame or CSV file (x_mm, y_mm, u_mm, v_mm), or a video to
            track without a camera file; simulated by a finite-strain run if None.
        presses: Other pictures of the same finger under the same contact, from which `fem-id` learns before.
        learned: What earlier pictures have taught of the finger; that of the design's file if None.
        learn: Design file to write, .toml, with what all pictures have taught.
        truth: What is simulated then, such as "sliding" (if None), "cylinder" or "3d".
        size: Largest element in walls and ribs, mm.
        adapt: Tolerance of `fem` at the markers, mm, for which the mesh is refined.
        material: The elastic constants; each solver takes the law that it has.
        load: Motion of the indenter, or its kind alone.
        reference: Name of the solver that the others are compared with; `fem`, else the first, if None.
        out: Folder for the files of `compare` on the command line; nothing is written if None.
        resume: Whether to take over solutions that an earlier run with the same `out` finished.
        progress: Whether to show the stages; if None in a notebook only.
        given: Parameters of finger, material and load, as for `solve`.

    Raises:
        UserError: If the comparison cannot be made.
    """
    from pinnray.comparison.pipeline.job import Job, checked
    from pinnray.comparison.pipeline.pipeline import compute, run
    from pinnray.options.preset_jobs import job_defaults
    from pinnray.options.solver_choice import spare_solvers
    from pinnray.runtime.stages import shown_stages

    if resume and out is None:
        raise UserError("resume goes on with the output folder of an earlier run; name it as out")
    if adapt is not None and (isinstance(adapt, bool) or not isinstance(adapt, int | float)):
        raise UserError(f"adapt = {adapt!r} is no number; give a tolerance in mm")
    words = "solvers size adapt material load measurements presses learned learn truth preset reference"
    finger, elastic, moved = read_job(design, material, load, given, besides=words.split())
    chosen = read_solvers(job_defaults(preset).solvers.split(",") if solvers is None else solvers, preset)
    job = Job(
        design=finger,
        solvers=chosen,
        spare=spare_solvers(chosen, reference, preset),
        mesh=mesh_settings(size),
        adapt=adapt,
        material=elastic,
        load=moved,
        measurements=read_observations(measurements, finger),
        presses=[found for each in presses if (found := read_observations(each, finger))],
        learned=learned_of(design) if learned is None else learned,
        learn=None if learn is None else as_path(learn, "learn"),
        truth=truth,
        reference=reference,
        resume=resume,
    )
    with shown_stages(progress) as stages:
        if out is not None:
            compared = run(replace(job, out=as_path(out, "out")), stages)
        else:
            with TemporaryDirectory() as folder:
                compared = compute(checked(job), stages, Path(folder))
    for remark in [*compared.remarks, *compared.unfinished]:
        warnings.warn(remark, stacklevel=2)
    return compared


def crossval(
    design: str | Path | Finger = "default",
    solvers: str | Sequence[str | Solver] = ("fem", "fem-asm", "gp"),
    *,
    out: str | Path,
    measurements: "str | Path | Observations | pd.DataFrame | None" = None,
    size: float | MeshSettings | None = None,
    material: Material | str | None = None,
    load: Load | LoadKind | None = None,
    progress: bool | None = None,
    **study: Any,
) -> "CrossvalResult":
    """Judge solvers by markers, loads and fields that they were not given; warns of folds that fail.

    Args:
        design: The finger, in one of the ways of `mesh`.
        solvers: Solvers or their names.
        out: Output folder; finished folds in it are reused.
        measurements: As for `compare`, but no film.
        size: Largest element in walls and ribs, mm; 0.5 if None.
        material: The elastic constants.
        load: Motion of the indenter, or its kind alone.
        progress: Whether to show the stages; if None in a notebook only.
        study: Further attributes of `studies.crossval.study.CrossvalStudy`, such as `truths`, `schemes`,
            `seeds`, `noise`; and parameters of finger, material and load, as for `solve`.

    Returns:
        The scores; `table()` has them by truth, layout, solver, scheme and score.

    Raises:
        UserError: If the study cannot be made, or the folder holds another one.
    """
    from pinnray.runtime.stages import shown_stages
    from pinnray.studies.crossval.cross_validation import cross_validate
    from pinnray.studies.crossval.study import CrossvalStudy

    own = [each.name for each in fields(CrossvalStudy)]
    words = {name: study.pop(name) for name in list(study) if name not in own}
    finger, elastic, moved = read_job(design, material, load, words, besides=own)
    for name in SEVERAL & study.keys():
        study[name] = (study[name],) if isinstance(study[name], str) else study[name]
    job = CrossvalStudy(
        design=finger,
        solvers=read_solvers(solvers),
        out=as_path(out, "out"),
        mesh=mesh_settings(size),
        material=elastic,
        load=moved,
        measurements=read_observations(measurements, finger),
        **study,
    )
    with shown_stages(progress) as stages:
        found = cross_validate(job, stages)
    for name, message in found.failed.items():
        warnings.warn(f"{name} failed, and is tried again by the same call: {message}", stacklevel=2)
    return found


def benchmark(
    solvers: str | Sequence[str | Solver] = ("fem", "fem-nonlinear", "pinn-std"),
    *,
    preset: str | None = None,
    problems: str = "small",
    entries: str | Path | None = None,
    time_limit: float = 600.0,
    out: str | Path | None = None,
    progress: bool | None = None,
) -> "Benchmark":
    """Score solvers on a fixed set of problems: accuracy, cost, and whether what they claim is true.

    Args:
        solvers: Solvers or their names: `benchmark([MySolver()])`.
        preset: Of the networks among them.
        problems: The set, `small` or `full`.
        entries: Folder with entries of others to show beside them.
        time_limit: Longest time for a problem, s; a solver of a notebook or the calling script has none.
        out: Folder for the files of `pinnray benchmark`; the same call goes on where it was stopped. None
            keeps nothing.
        progress: Whether to show the stages; if None in a notebook only.

    Returns:
        The entries; `table()` has a row for each of them and problem, with the claims that are not true.

    Raises:
        UserError: If the benchmark cannot be run, or the folder holds something else.
    """
    from pinnray.runtime.stages import shown_stages
    from pinnray.studies.benchmark.benchmark import BenchmarkJob, run_benchmark
    from pinnray.studies.benchmark.page import write_benchmark

    with output_folder(out) as folder, shown_stages(progress) as stages:
        job = BenchmarkJob(
            solvers=read_solvers(solvers, preset),
            out=Path(folder),
            which=problems,
            time_limit=time_limit,
            others=None if entries is None else as_path(entries, "entries"),
        )
        found = run_benchmark(job, stages)
        if out is not None:
            write_benchmark(found, job.out, stages.record())
    for remark in found.remarks:
        warnings.warn(remark, stacklevel=2)
    return found


SEVERAL = {"truths", "layouts", "schemes"}
"""Attributes of a cross-validation that are lists of names, of which one may stand alone."""

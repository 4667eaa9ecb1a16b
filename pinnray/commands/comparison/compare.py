"""The main job: solve one finger with several solvers and compare them."""

import re
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from rich.console import Console

from pinnray.film.film import FilmSettings
from pinnray.options.file import (
    OPTION,
    given_options,
    note_inputs,
    note_versions,
    read_options_file,
    usual_options,
)
from pinnray.options.shared import (
    FINGER,
    OUTPUT,
    FilmOptions,
    FingerOptions,
    OptionalOutputPath,
    OutputFlag,
    PhysicsOptions,
    PressOptions,
    SolverOptions,
    comma_list,
    read_millimetres,
)
from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import NOT_CONVERGED, say
from pinnray.runtime.machine import cores

if TYPE_CHECKING:
    from pinnray.film.measured_film import MeasuredFilm


def command(
    *,
    finger: FingerOptions = FingerOptions(),
    physics: PhysicsOptions = PhysicsOptions(),
    options: SolverOptions = SolverOptions(),
    taught: PressOptions = PressOptions(),
    adapt: Annotated[float | None, Parameter(group=FINGER)] = None,
    solvers: str | None = None,
    measurements: str | None = None,
    truth: str | None = None,
    film: FilmOptions = FilmSettings(),
    reference: str | None = None,
    from_: Annotated[Path | None, Parameter(name=OPTION)] = None,
    out: OptionalOutputPath = None,
    pictures: Annotated[str, Parameter(group=OUTPUT)] = "",
    width: Annotated[str | None, Parameter(group=OUTPUT)] = None,
    resume: OutputFlag = False,
    json_: Annotated[bool, Parameter(name="--json", group=OUTPUT)] = False,
) -> int:
    """Solve one finger with several solvers and compare them at the markers and on the shared mesh.

    Draws and meshes the finger, solves it with every solver, and writes a report with tables, pictures and
    fields. Examples:

    - compare --design default
    - compare --design slender --solvers fem
    - compare --set rib_count=6 --set height=110 --measurements markers.csv
    - compare --design default --measurements video.mkv --camera camera.json
    - compare --truth cylinder
    - compare --preset paper --device cuda
    - compare --from out/default/run.json --out out/again

    Args:
        adapt: Refine the mesh until the estimated error of fem at the markers is below this, mm.
        solvers: Names of solvers, separated by commas; `pinnray solvers` lists them. Default: those of the
            complete table that support the problem.
        measurements: CSV file of marker displacements (x_mm, y_mm, u_mm, v_mm), or a video, a folder or
            glob of pictures to track. Default: simulated by a finite-strain run, and labelled as such.
        truth: What is simulated where nothing is measured, such as sliding (the default), cylinder or 3d;
            docs/how-to/own-truth.md has all.
        reference: Solver that the others are compared with; default fem, else the first.
        from_: File with options that the command line leaves out: TOML or JSON with a table `options`, or the
            run.json of an earlier run, which is repeated so; default: none.
        out: Output folder; default out/DESIGN, or out/DESIGN-MEASUREMENTS with the name of their file, unless
            that holds the finished run of another job.
        pictures: Formats of the pictures besides PNG (default: none), separated by commas: svg, pdf.
        width: Width of the pictures, such as 85mm (a journal's column); default 140mm, with svg or pdf 180mm.
        resume: Reuse solutions that an earlier run finished.
        json_: Print metrics.json and nothing else.
    """
    from pinnray.comparison.pipeline.job import Job, prepared
    from pinnray.comparison.pipeline.pipeline import run
    from pinnray.comparison.pipeline.solving import second_process, worth_starting
    from pinnray.comparison.report.tables import body_table, marker_table
    from pinnray.options.preset_jobs import job_defaults
    from pinnray.options.solver_choice import spare_solvers
    from pinnray.runtime.output_folder import RUN_FILE, check_output, check_same_job
    from pinnray.runtime.stages import Stages
    from pinnray.vision.measurements import parse_weighed

    earlier = read_options_file(from_) if from_ else None
    if from_ and earlier:
        note_versions(from_, earlier)
    design, mesh = finger.read(options.preset)
    material, load = physics.read(options.preset)
    names = job_defaults(options.preset).solvers if solvers is None else solvers
    given = given_options(
        *(finger, physics, options, taught, film),
        **{"adapt": adapt, "solvers": solvers, "measurements": measurements, "truth": truth},
        **{"reference": reference, "pictures": pictures, "width": width},
    )
    folder = out or _own_folder(design.name, measurements)
    if out is None and not resume:
        check_same_job(folder, given, usual_options(finger, physics, options, taught, film))
    job = Job(
        design=design,
        mesh=mesh,
        adapt=adapt,
        material=material,
        load=load,
        truth=truth,
        measurements=_measurements(measurements, film),
        weighed=None if taught.weighed is None else parse_weighed(taught.weighed),
        presses=taught.files,
        learned=finger.learned(),
        learn=taught.learn,
        reference=reference,
        out=folder,
        resume=resume,
        picture_formats=comma_list(pictures),
        picture_width=read_millimetres(width),
        options=given,
    )
    check_output(folder)
    job = prepared(job)  # before the solvers are made, which takes seconds
    with nullcontext() if cores() < 2 else second_process(comma_list(names)) as pool:
        if pool and worth_starting(design, mesh):
            pool.start()  # which takes as long as to make the solvers here
        made, set_up = options.read(names), {text.partition(".")[0] for text in options.solver_set}
        finger.check_cost(design, mesh, made, simulated=measurements is None)
        spare = spare_solvers(made, reference, options.preset, set_up)
        job = replace(job, solvers=made, spare=spare)
        try:
            with Stages(Console(stderr=True), quiet=json_) as stages:
                comparison = run(job, stages, pool)
        except KeyboardInterrupt:
            kept = job.out.with_name(f"{job.out.name}.partial").exists()
            note = (
                "what was finished is kept; --resume goes on from it" if kept else "nothing was finished yet"
            )
            raise KeyboardInterrupt(note) from None
    if from_ and earlier:
        note_inputs(from_, earlier, job.out / RUN_FILE)
    for remark in comparison.remarks:
        say(f"warning: {remark}")
    if json_:
        print((job.out / "metrics.json").read_text(encoding="utf-8"), end="")
    else:
        console = Console()
        if comparison.observations.known:
            console.print(marker_table(comparison))
            console.print()
        console.print(body_table(comparison))
        for evaluation in comparison.evaluations:
            if evaluation.identified:
                found = evaluation.identified.phrase(job.design.depth)
                console.print(f"{evaluation.label} found: {found}", soft_wrap=True, highlight=False)
        if job.learn is not None:
            kept = any(each.identified and each.converged for each in comparison.evaluations)
            said = job.learn if kept else "nothing, as no solver that identifies the finger converged"
            console.print(f"learned: {said}", soft_wrap=True, highlight=False)
        console.print(f"report: {job.out / 'report.html'}", soft_wrap=True, highlight=False)
    for fault in comparison.unfinished:
        say(f"error: {fault}")
    return NOT_CONVERGED if comparison.unfinished else 0


def _own_folder(name: str, measurements: str | None) -> Path:
    """The output folder of a job that names none: that of its finger and its measurements."""
    if measurements is None:
        return Path("out") / name
    source = re.sub(r"[^A-Za-z0-9._-]+", "-", Path(measurements).stem).strip("-.")
    return Path("out") / f"{name}-{source or 'measurements'}"


def _measurements(source: str | None, options: FilmSettings) -> "Path | MeasuredFilm | None":
    """A CSV file by its suffix, else a film."""
    if source is None:
        if options.model_fields_set:
            raise UserError("a camera, workspace, colour or method is for --measurements VIDEO; give it too")
        return None
    if Path(source).suffix.lower() == ".csv":
        return Path(source)
    from pinnray.film.measured_film import MeasuredFilm

    return MeasuredFilm(source=source, **options.model_dump())

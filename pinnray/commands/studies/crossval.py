"""Score solvers on held-out markers, loads and fields."""

from pathlib import Path

from rich.console import Console
from rich.text import Text

from pinnray.options.shared import (
    FingerOptions,
    OptionalOutputPath,
    PhysicsOptions,
    SolverOptions,
    comma_list,
    existing_table,
    going_on_from,
)
from pinnray.runtime.exits import NOT_CONVERGED, say
from pinnray.runtime.machine import process_count

TEXTS = ("solver", "held out")
"""Headings of columns of words."""


def command(
    *,
    finger: FingerOptions = FingerOptions(),
    physics: PhysicsOptions = PhysicsOptions(),
    options: SolverOptions = SolverOptions(),
    solvers: str = "fem,fem-nonlinear,fem-asm,fem-id,gp",
    schemes: str = "one-out,tip-out,random,load-out",
    truth: str = "sliding",
    layouts: str | None = None,
    seeds: int = 5,
    noise: float = 0.005,
    frame: str = "fixed",
    measurements: Path | None = None,
    processes: int | None = None,
    out: OptionalOutputPath = None,
) -> int:
    """Score solvers on markers, loads and fields that they were not given.

    A truth is a finite-strain simulation on a finer mesh; the marker displacements are taken from it with
    noise. The default --mesh-size is 0.5. Finished folds are kept: the same command again goes on where it
    was stopped.

    Args:
        solvers: Names of solvers, separated by commas.
        schemes: Hold-out schemes, separated by commas.
        truth: Truths, separated by commas, such as sliding,cylinder,3d, or all; docs/how-to/own-truth.md has
            them.
        layouts: Marker layouts at which the same truth is sampled, separated by commas; default: the
            design's own.
        seeds: Number of noise draws.
        noise: Standard deviation of a simulated marker's displacement, mm.
        frame: How the simulated pressed pictures lie, and how well that is known: fixed, or such as
            "turn 3 deg, shift 0.3 mm, scale 1 %".
        measurements: CSV file of marker displacements; default: simulated.
        processes: Solvers run at a time; default: one per core.
        out: Output folder; default out/crossval-DESIGN.
    """
    from pinnray.geometry.picture_frame import Registration
    from pinnray.runtime.stages import Stages
    from pinnray.runtime.tables import terminal_table
    from pinnray.studies.crossval.cross_validation import cross_validate
    from pinnray.studies.crossval.folds import LOAD
    from pinnray.studies.crossval.study import SIZES, CrossvalStudy
    from pinnray.studies.crossval.tables import all_tables, truth_tables
    from pinnray.vision.measurements import read_measurements

    design, mesh = finger.read(options.preset, SIZES)
    material, load = physics.read(options.preset)
    file = existing_table(measurements)
    study = CrossvalStudy(
        design=design,
        mesh=mesh,
        material=material,
        load=load,
        solvers=options.read(solvers),
        schemes=comma_list(schemes),
        truths=comma_list(truth),
        layouts=comma_list(layouts) if layouts else (),
        seeds=seeds,
        noise=noise,
        frame=Registration.parse(frame),
        measurements=read_measurements(file, marker_radius=design.marker_radius) if file else None,
        out=out or Path("out") / f"crossval-{design.name}",
        processes=process_count(processes, "--processes"),
    )
    finger.check_cost(design, mesh, study.solvers, simulated=True)
    if study.measurements and LOAD in study.schemes:
        say(f"warning: {LOAD} needs a truth at other loads, and is skipped with --measurements")
    with going_on_from(study.out), Stages() as stages:
        result = cross_validate(study, stages)
    several = result.samples["truth"].nunique() > 1
    for table in truth_tables(result)[-1:] if several else all_tables(result):
        Console().print(terminal_table(table.title, table.headings, table.rows, left=TEXTS, narrow=True))
        Console().print(Text(f"{table.caption}\n", style="table.caption"))
    names = ("report.html", "samples.csv", "scores.csv", "crossval.json")
    print(*(study.out / name for name in names), sep="\n")
    for name, message in result.failed.items():
        say(f"error: {name} failed, and is tried again by the same command: {message}")
    return 0 if result.samples["converged"].all() and not result.failed else NOT_CONVERGED

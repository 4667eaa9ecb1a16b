"""The command line: `compare`, the one-shot main job, and `pinnray` with every verb."""

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import App, Group, Parameter
from rich.console import Console

from compare.exits import EXIT_CODES, NOT_CONVERGED, say
from compare.launch import launched
from compare.options import Adapt, FingerOptions, PhysicsOptions, SolverOptions, existing
from geometry.errors import UserError
from solvers.adaptation import Adaptation

OUTPUT = Group("Output", sort_key=4, default_parameter=Parameter(negative="", show_default=False))

pinnray = App(
    name="pinnray",
    help="Can a physics-informed neural network stand in for finite elements on a real Fin Ray finger?",
    help_epilogue=EXIT_CODES,
    result_action="return_value",
    suppress_keyboard_interrupt=False,
)


@pinnray.command(help_epilogue=EXIT_CODES)
def compare(
    finger: FingerOptions = FingerOptions(),
    physics: PhysicsOptions = PhysicsOptions(),
    options: SolverOptions = SolverOptions(),
    *,
    adapt: Adapt = None,
    solvers: Annotated[
        str, Parameter(help="Names with commas between; `pinnray solvers` lists them.")
    ] = "fem,pinn-std",
    measurements: Annotated[
        Path | None,
        Parameter(
            help="CSV file of marker displacements (x_mm, y_mm, u_mm, v_mm). Without it they are simulated "
            "by a finite-strain run, and everything that shows them says so."
        ),
    ] = None,
    reference: Annotated[
        str | None, Parameter(help="Solver that the others are compared with; fem, else the first.")
    ] = None,
    out: Annotated[
        Path | None, Parameter(group=OUTPUT, help="Output folder; out/DESIGN if not given.")
    ] = None,
    resume: Annotated[
        bool, Parameter(group=OUTPUT, help="Take over solutions that an earlier run finished.")
    ] = False,
    quiet: Annotated[bool, Parameter(group=OUTPUT, help="No progress, no table.")] = False,
    json_: Annotated[
        bool, Parameter(name="--json", group=OUTPUT, help="Print metrics.json and nothing else.")
    ] = False,
) -> int:
    """Solve one finger with several solvers and compare them at the markers and on the shared mesh.

    Draws the finger, meshes it once, solves it with every solver, and writes a report with tables, pictures
    and fields. Examples:

    - compare --design default
    - compare --design slender --solvers fem
    - compare --set rib_count=6 --set height=110 --measurements markers.csv
    - compare --preset paper --device cuda
    """
    from compare.pipeline import Job, run
    from compare.stages import Stages
    from compare.tables import mae_table

    design, mesh = finger.read(options.preset)
    material, load = physics.read(options.preset)
    made = options.read(solvers)
    physics.check_law(made)
    job = Job(
        design=design,
        solvers=made,
        mesh=mesh,
        adapt=adapt,
        material=material,
        load=load,
        measurements=existing(measurements),
        reference=reference,
        out=out or Path("out") / design.name,
        resume=resume,
    )
    try:
        with Stages(Console(stderr=True), quiet=quiet or json_) as stages:
            outcome = run(job, stages)
    except KeyboardInterrupt:
        kept = job.out.with_name(f"{job.out.name}.partial").exists()
        note = "what was finished is kept; --resume goes on from it" if kept else "nothing was finished yet"
        raise KeyboardInterrupt(note) from None
    if json_:
        print((job.out / "metrics.json").read_text(encoding="utf-8"), end="")
    elif not quiet:
        console = Console()
        console.print(mae_table(outcome.evaluations, outcome.observations, outcome.reference))
        console.print(f"report: {job.out / 'report.html'}", soft_wrap=True, highlight=False)
    unconverged = [evaluation for evaluation in outcome.evaluations if not evaluation.converged]
    for evaluation in unconverged:
        say(f"error: {evaluation.solver} did not converge: {evaluation.message}")
    return NOT_CONVERGED if unconverged or not adapted_enough(outcome.adaptation) else 0


@pinnray.command
def design(
    finger: FingerOptions = FingerOptions(),
    *,
    out: Annotated[Path, Parameter(help="Folder for the files.")] = Path("out/cad"),
    formats: Annotated[str, Parameter(help="Some of step, stl, dxf, svg, with commas.")] = "step,stl,dxf,svg",
) -> int:
    """Draw the finger: CAD files of the solid, its markers separate bodies, and a dimensioned picture."""
    from compare.figures.design_drawing import draw_design
    from geometry.cache import cad_files

    chosen, _ = finger.read()
    paths = cad_files(chosen, out, formats=[name.strip() for name in formats.split(",") if name.strip()])
    picture = out / "design.png"
    draw_design(picture, chosen)
    for path in [*paths, picture]:
        print(path)
    return 0


@pinnray.command
def mesh(
    finger: FingerOptions = FingerOptions(),
    physics: PhysicsOptions = PhysicsOptions(),
    *,
    adapt: Adapt = None,
    out: Annotated[Path, Parameter(help="Folder for the files.")] = Path("out/mesh"),
) -> int:
    """Mesh the finger: the shared mesh as a VTU and a NumPy file, and a picture of it.

    Material and load matter for --adapt only.
    """
    from compare.adaptation import shared_mesh, write_rounds
    from compare.fields import write_mesh
    from compare.figures.mesh_drawing import draw_mesh
    from compare.stages import Stages

    chosen, settings = finger.read()
    material, load = physics.read()
    if out.is_file():
        raise UserError(f"--out {out}: this is a file; name a folder")
    with Stages(Console(stderr=True)) as stages:
        triangles, adaptation = shared_mesh(
            chosen, settings, stages, tolerance=adapt, material=material, load=load
        )
    out.mkdir(parents=True, exist_ok=True)
    if adaptation is not None:
        write_rounds(out / "adapt.csv", adaptation)
    write_mesh(out / "mesh.vtu", triangles)
    triangles.save(out / "mesh.npz")
    draw_mesh(out / "mesh.png", triangles)
    nodes, area = len(triangles.points), triangles.areas.sum()
    print(f"{nodes} nodes, {len(triangles.triangles)} triangles, area {area:.4f} mm^2")
    for name in ("mesh.vtu", "mesh.npz", "mesh.png", *(["adapt.csv"] if adaptation else [])):
        print(out / name)
    return 0 if adapted_enough(adaptation) else NOT_CONVERGED


@pinnray.command(help_epilogue=EXIT_CODES)
def solve(
    solver: Annotated[str, Parameter(help="Name of the solver; `pinnray solvers` lists them.")],
    finger: FingerOptions = FingerOptions(),
    physics: PhysicsOptions = PhysicsOptions(),
    options: SolverOptions = SolverOptions(),
    *,
    adapt: Adapt = None,
    out: Annotated[Path, Parameter(help="The VTU file for the fields.")] = Path("out/solution.vtu"),
) -> int:
    """Solve one finger with one solver and write its fields, without comparing anything."""
    from compare.adaptation import shared_mesh
    from compare.fields import write_vtu
    from compare.figures.force_chart import draw_force_displacement
    from compare.figures.labels import solver_label
    from compare.force_displacement import force_curves, write_force_displacement
    from compare.stages import Stages
    from compare.uncertainty import evaluated
    from compare.verdict import certified
    from solvers.problem import Problem
    from solvers.solver import with_law

    chosen, settings = finger.read(options.preset)
    material, load = physics.read(options.preset)
    if out.suffix != ".vtu":
        raise UserError(f"--out {out}: the fields are a VTU file; give a name that ends in .vtu")
    chosen_solvers = options.read(solver)
    if len(chosen_solvers) != 1:
        raise UserError(f"name one solver, not {solver!r}; `compare` takes several")
    physics.check_law(chosen_solvers)
    (made,) = chosen_solvers
    with Stages(Console(stderr=True)) as stages:
        triangles, adaptation = shared_mesh(
            chosen, settings, stages, tolerance=adapt, material=material, load=load, solvers=[made]
        )
        with stages.stage(made.name) as progress:
            problem = Problem(triangles, with_law(material, made), load)
            solution = made.solve(problem, progress)
        with stages.stage("certificate"):
            (evaluation,) = certified([evaluated(solution, triangles)], problem)
        write_vtu(out, triangles, evaluation)
        written = [out]
        if curves := force_curves([evaluation], load):
            written += [out.with_name(f"{out.stem}_force_displacement.{kind}") for kind in ("csv", "png")]
            write_force_displacement(written[1], curves, load, depth=chosen.depth)
            draw_force_displacement(written[2], curves=curves, depth=chosen.depth)
    print(f"{solver_label(evaluation)}: {evaluation.message}")
    u, v = solution.reaction
    print(f"energy {solution.energy:.6g} N mm/mm, reaction ({u:.6g}, {v:.6g}) N/mm")
    for path in written:
        print(path)
    return 0 if evaluation.converged and adapted_enough(adaptation) else NOT_CONVERGED


@pinnray.command(help_epilogue=EXIT_CODES)
def gridsearch(
    finger: FingerOptions = FingerOptions(),
    physics: PhysicsOptions = PhysicsOptions(),
    options: SolverOptions = SolverOptions(),
    *,
    learning_rates: Annotated[str, Parameter(help="With commas between.")] = "1e-4,1e-3,1e-2",
    bc_weights: Annotated[
        str, Parameter(help="Weights of the boundary conditions in the loss, MPa/mm², with commas.")
    ] = "0.1,1,10,100,1000",
    epochs: Annotated[
        int | None,
        Parameter(help="Of every run; 2,000 if not given, a short training, and 60,000 with --preset paper."),
    ] = None,
    processes: Annotated[
        int | None, Parameter(help="Runs at a time; as many as there are cores if not given.")
    ] = None,
    out: Annotated[
        Path | None, Parameter(group=OUTPUT, help="Output folder; out/gridsearch-DESIGN if not given.")
    ] = None,
) -> int:
    """Repeat the paper's search for the learning rate and the weight of the boundary conditions.

    Trains the paper's networks at every point of the grid, each run in a process of its own, and ranks them
    by their distance from `fem`. Finished runs are kept: the same command again goes on where it was stopped.
    """
    from compare.gridsearch import Search, search
    from compare.gridsearch_options import read_processes, read_settings, read_values
    from compare.gridsearch_run import FAILED
    from compare.gridsearch_tables import best_of, runs_table
    from compare.provenance import machine
    from compare.stages import Stages

    design, mesh = finger.read(options.preset)
    material, load = physics.read(options.preset)
    count, threads = read_processes(processes, int(machine()["cores"]))
    job = Search(
        design=design,
        mesh=mesh,
        material=material,
        load=load,
        learning_rates=read_values("learning-rates", learning_rates),
        bc_weights=read_values("bc-weights", bc_weights),
        settings=read_settings(options, epochs),
        out=out or Path("out") / f"gridsearch-{design.name}",
        processes=count,
        threads=threads,
    )
    physics.check_law([job.solver(point) for point in job.points])
    try:
        with Stages(Console(stderr=True)) as stages:
            runs = search(job, stages)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"the same command goes on from what {job.out} keeps") from None
    Console().print(runs_table(runs))
    for name in ("gridsearch.csv", "gridsearch.json", "gridsearch.png"):
        print(job.out / name)
    failed = [run for run in runs if run.status == FAILED]
    for run in failed:
        say(f"error: {run.point.name} failed, and is tried again by the same command: {run.message}")
    return 0 if best_of(runs) and not failed else NOT_CONVERGED


@pinnray.command
def solvers() -> int:
    """List the solvers, with the material laws and loads that each has, its presets and their settings."""
    from rich.table import Table

    from solvers.registry import PRESETS, make_solver, usable_solvers

    table = Table("solver", "laws", "loads", "settings")
    for name, usual in usable_solvers().items():
        _, *others = PRESETS.get(name, [""])
        for solver in [usual, *(make_solver(name, preset=preset) for preset in others)]:
            settings = [f"{key}={value}" for key, value in solver.settings().items()]
            table.add_row(name, *map("\n".join, (solver.laws, solver.loads, settings)))
    Console().print(table)
    return 0


@pinnray.command(help_epilogue=EXIT_CODES)
def calibrate(
    *images: Annotated[Path, Parameter(help="Photographs of the board, all of one size.")],
    board: Annotated[str, Parameter(help="Inner corners along either side, such as 9x6.")],
    square: Annotated[float, Parameter(help="Side of a square, mm.")],
    k3: Annotated[
        bool, Parameter(negative="", help="Fit the third radial coefficient too, for a wide lens.")
    ] = False,
    out: Annotated[Path, Parameter(group=OUTPUT, help="The camera, JSON or YAML.")] = Path("out/camera.json"),
) -> int:
    """Calibrate a camera from photographs of a chessboard, and say how well it is known."""
    from compare.calibration_table import calibration_table
    from vision.board import read_board, read_grey
    from vision.calibration import calibrate as calibrated
    from vision.camera import check_format, save_camera

    check_format(out)
    if not images:
        raise UserError("no photograph was given; name at least 4 that show the board")
    chessboard = read_board(board, square)
    calibration = calibrated({str(path): read_grey(path) for path in images}, chessboard, fit_k3=k3)
    save_camera(out, calibration.camera)
    for name in calibration.boardless:
        say(f"warning: no board of {chessboard} inner corners was found in {name}")
    Console().print(calibration_table(calibration))
    print(out)
    return 0


def adapted_enough(adaptation: Adaptation | None) -> bool:
    """Whether the tolerance of --adapt was reached, if there is one; a line on standard error if not."""
    if adaptation is None or adaptation.reached:
        return True
    say(f"error: --adapt {adaptation.tolerance:g}: {adaptation.message}")
    return False


def main(arguments: list[str] | None = None) -> int:
    """Entry of `pinnray`."""
    return launched(lambda: pinnray(arguments, exit_on_error=False, print_error=False))


def compare_main(arguments: list[str] | None = None) -> int:
    """Entry of `compare`: the same as `pinnray compare`."""
    given = sys.argv[1:] if arguments is None else arguments
    return main(["compare", *given])


if __name__ == "__main__":
    sys.exit(main())

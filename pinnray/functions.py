"""Functions of the front door: mesh, solve, compare, track, cross-validate."""

import warnings
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Literal

from geometry.cache import drawn_finger, finger_mesh
from geometry.drawing.description import Description, description_beside, load_description
from geometry.drawing.drawn_finger import DrawnFinger
from geometry.errors import UserError
from geometry.finger.design import Design
from geometry.finger.finger import Finger
from geometry.finger.presets import load_design
from geometry.mesh.settings import MeshSettings
from geometry.mesh.triangle_mesh import TriangleMesh
from geometry.observations import Observations
from pinnray.comparison import Comparison
from solvers.problem import Load, Material, Problem
from solvers.registry import make_solver
from solvers.solution import Solution
from solvers.solver import Solver, solved, with_law

if TYPE_CHECKING:
    import pandas as pd

    from compare.crossval.result import CrossvalResult


def mesh(design: str | Path | Finger = "default", **settings: Any) -> TriangleMesh:
    """The mesh of a finger, from the cache if it was made before.

    Args:
        design: A finger, the name of a preset, or the path of a TOML file or of a drawing.
        settings: Of `geometry.mesh.settings.MeshSettings`, such as `size=0.5`, mm.

    Raises:
        UserError: If the design or a setting is not admissible.
    """
    return finger_mesh(_design(design), settings=MeshSettings(**settings))


def load_drawing(file: str | Path, **description: Any) -> DrawnFinger:
    """The finger of a STEP, DXF or SVG drawing or of a Gmsh mesh.

    Args:
        file: The drawing. A TOML file of the same name beside it may hold its description.
        description: Lines of the description that are new or other: `clamp`, `contact`, `markers`, `depth`,
            `units` and so on, as in `geometry.drawing.description.Description`.

    Raises:
        UserError: If the drawing cannot be read, is no sound section, or the description does not fit it.
    """
    known = load_description(description_beside(Path(file))).model_dump(exclude_none=True)
    return drawn_finger(Path(file), Description(**{**known, **description}))


def solver(name: str, **settings: Any) -> Solver:
    """A solver by its name, with its defaults for the settings that are not given.

    Raises:
        UserError: If there is no such solver or setting, or a library that it needs is missing.
    """
    return make_solver(name, **settings)


def solve(
    problem: str | Path | Finger | Problem,
    solver: str | Solver = "fem",
    *,
    size: float | None = None,
    material: Material | None = None,
    load: Load | None = None,
    measurements: "str | Path | Observations | pd.DataFrame | None" = None,
) -> Solution:
    """Solve a problem, or a design with the usual material and load, with one solver.

    Warns of numbers that look like another unit, of unlikely measurements, and of a body that is turned
    inside out or goes through itself; the solution's status has these faults, too.

    Args:
        problem: A problem, or a design in one of the ways of `mesh`.
        solver: A solver or its name; it takes the material law that it has.
        size: Largest element in walls and ribs, mm; as the other arguments, for a design only.
        material: The elastic constants.
        load: Motion of the indenter.
        measurements: Marker displacements, for a solver that assimilates them.

    Raises:
        UserError: If the solver does not support the problem, or the measurements cannot be of it.
    """
    from compare.evaluation.deformed_body import DeformedBody
    from compare.evaluation.plausibility import check_positions, displacement_remarks, unit_remarks

    chosen = _solver(solver)
    if not isinstance(problem, Problem):
        finger = _design(problem)
        triangles = finger_mesh(finger, settings=_mesh_settings(size))
        given = _observations(measurements, finger)
        problem = Problem(triangles, material or Material(), load or Load(), given, finger)
    elif any(each is not None for each in (size, material, load, measurements)):
        raise UserError(
            "a Problem has its own mesh, material, load and observations; give a design to choose them"
        )
    problem = replace(problem, material=with_law(problem.material, chosen))
    remarks = [] if problem.finger is None else unit_remarks(problem)  # a body of a closed form has any unit
    if (given := problem.observations) is not None:
        check_positions(given, problem.mesh)
        remarks += displacement_remarks(given, problem)
    solution = solved(chosen, problem)
    status, faults = DeformedBody(problem.mesh).status(solution)
    for remark in [*status.warnings, *remarks, *faults]:
        warnings.warn(remark, stacklevel=2)
    return replace(solution, status=status)


def compare(
    design: str | Path | Finger = "default",
    solvers: str | Sequence[str | Solver] | None = None,
    *,
    measurements: "str | Path | Observations | pd.DataFrame | None" = None,
    truth: str = "sliding",
    size: float | None = None,
    adapt: float | None = None,
    material: Material | None = None,
    load: Load | None = None,
    reference: str | None = None,
    out: str | Path | None = None,
    resume: bool = False,
    progress: bool = False,
) -> Comparison:
    """Solve one finger with several solvers and compare them at the markers and on the shared mesh.

    Args:
        design: A finger, the name of a preset, or the path of a TOML file or of a drawing.
        solvers: Solvers or their names; those of the complete table that support the problem if None.
        measurements: Marker displacements: a data frame or CSV file (x_mm, y_mm, u_mm, v_mm), or a video to
            track without a camera file; simulated by a finite-strain run if None.
        truth: What is simulated then: "sliding", "stvk", "gent", "cylinder", "oblique", "friction",
            "rubbing", "3d" or "sticking".
        size: Largest element in walls and ribs, mm.
        adapt: Tolerance of `fem` at the markers, mm, for which the mesh is refined.
        material: The elastic constants; each solver takes the law that it has.
        load: Motion of the indenter.
        reference: Name of the solver that the others are compared with; `fem`, else the first, if None.
        out: Folder for the files of `compare` on the command line; nothing is written if None.
        resume: Whether to take over solutions that an earlier run with the same `out` finished.
        progress: Whether to show the stages on standard error.

    Raises:
        UserError: If the comparison cannot be made.
    """
    from compare.pipeline.job import Job, checked
    from compare.pipeline.pipeline import compute, run
    from compare.runtime.stages import Stages
    from pinnray.options.preset_jobs import job_defaults

    finger = _design(design)
    names = job_defaults(None).solvers.split(",") if solvers is None else solvers
    chosen = [_solver(each) for each in ([names] if isinstance(names, str) else names)]
    job = Job(
        design=finger,
        solvers=chosen,
        spare=[each.name for each in chosen if each.name != reference] if solvers is None else (),
        mesh=_mesh_settings(size),
        adapt=adapt,
        material=material or Material(),
        load=load or Load(),
        measurements=_observations(measurements, finger),
        truth=truth,
        reference=reference,
        resume=resume,
    )
    with Stages(quiet=not progress) as stages:
        if out is not None:
            return Comparison.of(run(replace(job, out=Path(out)), stages))
        with TemporaryDirectory() as folder:
            return Comparison.of(compute(checked(job), stages, Path(folder)))


def track(
    source: str | Path,
    design: str | Path | Finger = "default",
    *,
    camera: str | Path | None = None,
    workspace: str | Path | None = None,
    colour: str = "dark",
    method: Literal["precise", "hough"] = "precise",
    fps: float | None = None,
    out: str | Path | None = None,
) -> Observations:
    """Measure the markers of a finger in a film that shows it at rest, pressed, and held.

    Args:
        source: Video, folder or glob of pictures, or number of a camera.
        design: The finger, in one of the ways of `mesh`.
        camera: Camera file, as `pinnray calibrate` writes it.
        workspace: JSON file of the fiducials; those around the design if None.
        colour: Of the markers, as `pinnray pick` prints it.
        method: Detection of the discs; `hough` is the paper's pipeline.
        fps: Frames a second of pictures, which do not say it; 30 if None.
        out: Folder for observations, tracks and pictures; nothing is kept if None.

    Raises:
        UserError: If the film does not show the finger.
    """
    from compare.camera.film import Film
    from compare.camera.track_film import track_film
    from solvers.solver import silent

    film = Film(
        str(source),
        camera=None if camera is None else Path(camera),
        workspace=None if workspace is None else Path(workspace),
        colour=colour,
        method=method,
        fps=fps,
    )
    with TemporaryDirectory() if out is None else nullcontext(out) as folder:
        Path(folder).mkdir(parents=True, exist_ok=True)
        _, observations = track_film(film, _design(design), Path(folder), silent, video=out is not None)
    return observations


def crossval(
    design: str | Path | Finger = "default",
    solvers: str | Sequence[str | Solver] = ("fem", "fem-asm", "gp"),
    *,
    out: str | Path,
    measurements: "str | Path | Observations | pd.DataFrame | None" = None,
    size: float | None = None,
    material: Material | None = None,
    load: Load | None = None,
    progress: bool = False,
    **study: Any,
) -> "CrossvalResult":
    """Judge solvers by markers, loads and fields that they were not given.

    Args:
        design: The finger, in one of the ways of `mesh`.
        solvers: Solvers or their names.
        out: Output folder; finished folds in it are reused.
        measurements: As for `compare`, but no film.
        size: Largest element in walls and ribs, mm; 0.5 if None.
        material: The elastic constants.
        load: Motion of the indenter.
        progress: Whether to show the stages on standard error.
        study: Further attributes of `compare.crossval.study.CrossvalStudy`, such as `truths`, `schemes`,
            `seeds`, `noise`.

    Returns:
        The scores; `table()` has them by truth, layout, solver and scheme.

    Raises:
        UserError: If the study cannot be made, or the folder holds another one.
    """
    from compare.crossval.cross_validation import cross_validate
    from compare.crossval.study import ELEMENT_SIZE, CrossvalStudy, solver_variants
    from compare.runtime.stages import Stages

    finger, elastic = _design(design), material or Material()
    chosen = [_solver(each) for each in ([solvers] if isinstance(solvers, str) else solvers)]
    job = CrossvalStudy(
        design=finger,
        variants=solver_variants(chosen, elastic),
        out=Path(out),
        mesh=MeshSettings(size=ELEMENT_SIZE if size is None else size),
        material=elastic,
        load=load or Load(),
        measurements=_observations(measurements, finger),
        **study,
    )
    with Stages(quiet=not progress) as stages:
        return cross_validate(job, stages)


def _design(design: str | Path | Finger) -> Finger:
    if isinstance(design, str | Path):
        drawn = Path(design).suffix.lower() in (".step", ".stp", ".dxf", ".svg", ".msh")
        return load_drawing(design) if drawn else load_design(design)
    if not isinstance(design, Design | DrawnFinger):
        raise UserError(f"{design!r} is no design; give a finger, the name of a preset or a file")
    return design


def _solver(given: str | Solver) -> Solver:
    if isinstance(given, type) or not isinstance(given, str | Solver):
        raise UserError(
            f"{given!r} is no solver; give one that is made, such as pr.solver('fem'), or its name"
        )
    return solver(given) if isinstance(given, str) else given


def _mesh_settings(size: float | None) -> MeshSettings:
    return MeshSettings() if size is None else MeshSettings(size=size)


def _observations(
    given: "str | Path | Observations | pd.DataFrame | None", design: Finger
) -> Observations | None:
    """Observations from a data frame, a CSV file, or a film."""
    from vision.measurements import read_measurements

    if given is None or isinstance(given, Observations):
        return given
    if isinstance(given, str | Path):
        if Path(given).suffix.lower() != ".csv":
            return track(given, design)
        return read_measurements(Path(given), marker_radius=design.marker_radius)
    if not hasattr(given, "to_csv"):
        raise UserError(
            f"measurements that are a {type(given).__name__}; give a data frame, Observations, or a file"
        )
    with TemporaryDirectory() as folder:
        path = Path(folder) / "measurements.csv"
        given.to_csv(path, index=False)
        try:
            read = read_measurements(path, marker_radius=design.marker_radius)
        except UserError as error:
            raise UserError(str(error).replace(str(path), "the data frame")) from None
    return replace(read, source="measurements from a data frame")

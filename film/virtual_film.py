"""A film of the virtual rig: the displacements that are filmed, and the files of the film."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from pinnray.comparison.evaluation.truths import SLIDING
from pinnray.comparison.evaluation.virtual_experiment import experiment_source, simulate
from pinnray.film.filmed_force import LONGEST_STEP, filmed_course, true_forces
from pinnray.film.rig_settings import RigSettings
from pinnray.runtime.errors import UserError
from pinnray.runtime.machine import machine, package_versions
from pinnray.runtime.output_folder import replaced_folder, write_run
from pinnray.runtime.stages import Stages
from pinnray.runtime.tables import write_csv
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import Solver, check_law, solved, with_law
from pinnray.vision.rig.bench import Bench
from pinnray.vision.rig.boards import board_poses, board_scene
from pinnray.vision.rig.exposure import Exposure
from pinnray.vision.rig.motion import Motion
from pinnray.vision.rig.recording import Recording
from pinnray.vision.rig.recording_files import photograph, record


def filmed_solution(problem: Problem, solver: Solver | None, stages: Stages) -> tuple[Solution, str]:
    """The displacements to film, and a sentence on their source.

    Args:
        problem: The finger with mesh, material and load.
        solver: Whose displacements are filmed; the finite-strain simulation of `compare` if None.
        stages: Shows the progress.

    Raises:
        UserError: If there is no solution to film.
    """
    if solver is None:
        law, kind = problem.material.law, problem.load.kind
        if "law" in problem.material.model_fields_set and law != SLIDING.law:
            raise UserError(f"law {law}: the simulated finger has {SLIDING.law}; name a solver that has it")
        if kind != "mean":
            raise UserError(f"load {kind}: a patch presses the simulated finger; name a solver that takes it")
        free = replace(problem, finger=None)
        with stages.stage("virtual experiment") as progress:
            solution = simulate(free, progress, max_step=LONGEST_STEP)
        return solution, experiment_source(free)
    check_law([solver], problem.material)
    with stages.stage(solver.name) as progress:
        problem = replace(problem, material=with_law(problem.material, solver))
        solution = solved(solver, problem, progress)
    if not solution.status.converged:
        raise UserError(f"{solver.name} {solution.status.message}; its displacements are not filmed")
    return solution, f"displacements of {solver.name}, rendered by the virtual rig; no camera was involved"


def film_finger(
    problem: Problem,
    solver: Solver | None,
    out: Path,
    stages: Stages,
    *,
    rig: RigSettings,
    exposure: Exposure,
    motion: Motion,
    codec: str = "ffv1",
    seed: int = 0,
    options: Mapping[str, object] = MappingProxyType({}),
) -> None:
    """Render a film of a pressed finger into a folder, with its truth and photographs of a board.

    Args:
        problem: The finger with mesh, material and load.
        solver: See `filmed_solution`.
        out: The folder, which is replaced.
        stages: Shows the progress.
        rig: Camera, markers and board.
        exposure: Light, lens and sensor.
        motion: Numbers of frames at rest, moving and held.
        codec: Of the video.
        seed: Of the noise.
        options: Of the command line, for `run.json`.

    Raises:
        UserError: If the finger cannot be filmed so.
    """
    finger, mesh = problem.finger, problem.mesh
    if finger is None:
        raise UserError("a film is of a finger")
    workspace, camera, pose = rig.view(finger)
    board = rig.sheet()
    bench = Bench(mesh, finger, workspace, rig.paint, rig.irregular)
    solution, source = filmed_solution(problem, solver, stages)
    displacement, course = solution.displacement(mesh.at_nodes()), filmed_course(solution)
    recording = Recording(bench, displacement, camera, pose, exposure, motion, seed=seed, course=course)
    with replaced_folder(out) as folder:
        with stages.stage("film") as progress:
            record(recording, folder, source=source, codec=codec, progress=progress)
        forces = true_forces(solution, recording, finger.depth, problem.material.loss)
        write_csv(folder / "truth_force.csv", forces)
        if rig.boards:
            with stages.stage("boards") as progress:
                poses = board_poses(board, camera, rig.boards, seed=seed)
                photograph(board_scene(board), poses, recording, folder / "boards", progress=progress)
        made_by = {"versions": package_versions(), "machine": machine(), "options": dict(options)}
        write_run(folder, {"source": source, **made_by, "rig": rig.model_dump(mode="json")})

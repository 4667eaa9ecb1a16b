"""A film of the virtual rig: the displacements that are filmed, and the files of the film."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pinnray.comparison.evaluation.truths import experiment_source, simulate
from pinnray.film.filmed_force import LONGEST_STEP, true_forces
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.errors import UserError
from pinnray.runtime.machine import machine, package_versions
from pinnray.runtime.output_folder import replaced_folder, write_run
from pinnray.runtime.stages import Stages
from pinnray.runtime.tables import write_csv
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import Solver, solved, with_law
from pinnray.vision.calibration.chessboard import Board
from pinnray.vision.rig.boards import board_poses, board_scene
from pinnray.vision.rig.recording import Recording
from pinnray.vision.rig.recording_files import photograph, record


def filmed_solution(
    mesh: TriangleMesh, design: Finger, material: Material, load: Load, solver: Solver | None, stages: Stages
) -> tuple[Solution, str]:
    """The displacements to film, and a sentence on their source.

    Args:
        mesh: Of the finger.
        design: The finger.
        material: Elastic constants.
        load: What moves the finger.
        solver: Whose displacements are filmed; the finite-strain simulation of `compare` if None.
        stages: Shows the progress.

    Raises:
        UserError: If there is no solution to film.
    """
    if solver is None:
        problem = Problem(mesh, material, load)
        with stages.stage("virtual experiment") as progress:
            solution = simulate(problem, progress, max_step=LONGEST_STEP)
        return solution, experiment_source(problem)
    with stages.stage(solver.name) as progress:
        problem = Problem(mesh, with_law(material, solver), load, finger=design)
        solution = solved(solver, problem, progress)
    if not solution.status.converged:
        raise UserError(f"{solver.name} {solution.status.message}; its displacements are not filmed")
    return solution, f"displacements of {solver.name}, rendered by the virtual rig; no camera was involved"


def write_film(
    recording: Recording,
    solution: Solution,
    out: Path,
    stages: Stages,
    *,
    source: str,
    codec: str = "ffv1",
    board: Board,
    boards: int = 0,
    facts: Mapping[str, Any],
) -> None:
    """Render a film into a folder, with its truth and photographs of a calibration board.

    Args:
        recording: The film.
        solution: Whose displacements it shows.
        out: The folder, which is replaced.
        stages: Shows the progress.
        source: A sentence on the displacements.
        codec: Of the video.
        board: To calibrate the camera with.
        boards: Number of its photographs.
        facts: Further provenance.
    """
    with replaced_folder(out) as folder:
        with stages.stage("film") as progress:
            record(recording, folder, source=source, codec=codec, progress=progress)
        write_csv(folder / "truth_force.csv", true_forces(solution, recording, recording.bench.finger.depth))
        if boards:
            with stages.stage("boards") as progress:
                poses = board_poses(board, recording.camera, boards, seed=recording.seed)
                photograph(board_scene(board), poses, recording, folder / "boards", progress=progress)
        shown = {"board": str(board) if boards else None}
        made = {"versions": package_versions(), "machine": machine()}
        write_run(folder, {"source": source, **facts, **shown, **made})

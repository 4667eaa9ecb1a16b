"""The paper's grid search for a learning rate and a weight of the boundary conditions."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path
from typing import Any

from compare.runtime.output_folder import locked
from compare.runtime.provenance import cores
from compare.runtime.resumable_folder import check_resumable_folder, job_definition
from compare.runtime.stages import Stages, in_stages
from geometry.atomic import write_json
from geometry.cache import finger_mesh
from geometry.finger.finger import Finger
from geometry.mesh.settings import MeshSettings
from geometry.processes import ProcessFailed
from solvers.problem import Load, Material, Problem
from solvers.registry import make_solver
from solvers.solver import Solver, check_load
from studies.gridsearch.tables import best_of, ranked, run_note, write_runs
from studies.gridsearch.training_run import (
    FAILED,
    RESULT_FILE,
    GridPoint,
    ReferenceSolution,
    TrainingRun,
    TrainingTask,
    train,
)

SEARCH_FILE = "search.json"


@dataclass(frozen=True)
class GridSearch:
    """A grid search to run, and its output folder.

    Attributes:
        design: The finger.
        mesh: Element sizes.
        material: The elastic law.
        load: The prescribed displacement of the contact.
        learning_rates: Learning rates of the optimiser.
        bc_weights: Weights of the boundary conditions in the loss, MPa/mm².
        settings: The other settings of `pinn-std`, its preset `paper` among them.
        out: Output folder; runs that an earlier search with the same settings finished there are reused.
        processes: Runs trained at a time.
        picture_formats: Formats of the picture besides PNG.
    """

    design: Finger
    mesh: MeshSettings
    material: Material
    load: Load
    learning_rates: Sequence[float]
    bc_weights: Sequence[float]
    settings: Mapping[str, object]
    out: Path
    processes: int
    picture_formats: Sequence[str] = ()

    @property
    def points(self) -> list[GridPoint]:
        """The points of the grid."""
        return [GridPoint(*pair) for pair in product(self.learning_rates, self.bc_weights)]

    def folder(self, point: GridPoint) -> Path:
        """Folder of a point's checkpoints and result."""
        return self.out / "runs" / point.name

    def solver(self, point: GridPoint) -> Solver:
        """The solver of a point."""
        return make_solver("pinn-std", **self.settings, **asdict(point))


def search_grid(search: GridSearch, stages: Stages | None = None) -> list[TrainingRun]:
    """Train at every point of the grid that has no result yet, and write tables and picture.

    Args:
        search: The grid and the shared settings.
        stages: Shows the progress; None shows nothing.

    Returns:
        The runs, the one nearest to `fem` first.

    Raises:
        UserError: If the search cannot be done, or the folder holds something else.
    """
    stages = stages or Stages(quiet=True)
    solver, *_ = (search.solver(point) for point in search.points)
    check_load(solver, search.load)
    definition = _definition(search, solver)
    check_resumable_folder(search.out / SEARCH_FILE, definition, job="grid search")
    with stages.stage("mesh"):
        problem = Problem(finger_mesh(search.design, settings=search.mesh), search.material, search.load)
    search.out.mkdir(parents=True, exist_ok=True)
    with locked(search.out):
        write_json(search.out / SEARCH_FILE, definition)
        files = {point: search.folder(point) / RESULT_FILE for point in search.points}
        results = {point: TrainingRun.load(path) for point, path in files.items() if path.exists()}
        if missing := [point for point in search.points if point not in results]:
            results |= _trained(search, missing, problem, stages)
        runs = ranked(list(results.values()))
        write_runs(search.out / "gridsearch.csv", runs)
        with stages.stage("picture"):
            from studies.gridsearch.chart import draw_grid

            draw_grid(runs=runs).save(search.out / "gridsearch.png", search.picture_formats)
        best = best_of(runs)
        write_json(
            search.out / "gridsearch.json",
            {
                **definition,
                "learning_rates": list(search.learning_rates),
                "bc_weights": list(search.bc_weights),
                "ranked_by": "rel_l2_displacement: relative L2 difference from fem on the same mesh",
                "best": best and asdict(best),
                "runs": [asdict(run) for run in runs],
                "problem_sha256": problem.digest,
                **stages.record(),
            },
        )
    return runs


def _definition(search: GridSearch, solver: Solver) -> dict[str, Any]:
    """Everything that the result of a run depends on, except its point of the grid."""
    searched = {"learning_rate", "bc_weight"}
    return job_definition(search.design, search.mesh, search.material, search.load, __name__) | {
        "solver": {key: value for key, value in solver.settings().items() if key not in searched}
    }


def _trained(
    search: GridSearch, points: Sequence[GridPoint], problem: Problem, stages: Stages
) -> dict[GridPoint, TrainingRun]:
    """Train at points of the grid, each in a process of its own."""
    with stages.stage("fem") as progress:
        reference = ReferenceSolution.of(make_solver("fem").solve(problem, progress))
    mesh = search.out / "mesh.npz"
    problem.mesh.save(mesh)
    tasks = {
        point.name: TrainingTask(
            point=point,
            settings=search.settings,
            mesh=mesh,
            material=search.material,
            load=search.load,
            reference=reference,
            folder=search.folder(point),
            threads=max(1, cores() // search.processes),
        )
        for point in points
    }

    def run_of(name: str, answer: TrainingRun | ProcessFailed) -> TrainingRun:
        if isinstance(answer, ProcessFailed):
            return TrainingRun(tasks[name].point, FAILED, answer.message)
        return answer

    answers = in_stages(
        train,
        tasks,
        processes=search.processes,
        stages=stages,
        kind="runs",
        note=lambda name, answer: run_note(run_of(name, answer)),
    )
    return {tasks[name].point: run_of(name, answer) for name, answer in answers}

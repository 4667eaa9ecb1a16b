"""The paper's grid search for a learning rate and a weight of the boundary conditions."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from itertools import product
from pathlib import Path
from typing import Any

from compare.gridsearch.tables import best_of, ranked, run_note, write_runs
from compare.gridsearch.training_run import FAILED, RESULT_FILE, Point, Reference, Run, Task, train
from compare.runtime.kept_folder import check_kept_folder
from compare.runtime.output_folder import locked
from compare.runtime.processes import ProcessFailed
from compare.runtime.provenance import machine, package_versions, sources_digest
from compare.runtime.staged_processes import in_stages
from compare.runtime.stages import Stages
from geometry.atomic import write_json
from geometry.cache import finger_mesh
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from solvers.problem import Load, Material, Problem
from solvers.registry import make_solver
from solvers.solver import Solver, check_load

SEARCH_FILE = "search.json"


@dataclass(frozen=True)
class Search:
    """What to search, and where to write.

    Attributes:
        design: The finger.
        mesh: Element sizes.
        material: The elastic law.
        load: What moves the finger.
        learning_rates: Of the optimiser.
        bc_weights: Weights of the boundary conditions in the loss, MPa/mm².
        settings: The other settings of `pinn-std`, its preset `paper` among them.
        out: Output folder; what an earlier search with the same settings finished there is taken over.
        processes: How many runs are trained at a time.
        threads: Threads of each.
    """

    design: Design
    mesh: MeshSettings
    material: Material
    load: Load
    learning_rates: Sequence[float]
    bc_weights: Sequence[float]
    settings: Mapping[str, object]
    out: Path
    processes: int
    threads: int

    @property
    def points(self) -> list[Point]:
        """The points of the grid."""
        return [Point(*pair) for pair in product(self.learning_rates, self.bc_weights)]

    def folder(self, point: Point) -> Path:
        """Where the run of a point keeps its checkpoints and its result."""
        return self.out / "runs" / point.name

    def solver(self, point: Point) -> Solver:
        """The solver of a point."""
        return make_solver("pinn-std", **self.settings, **asdict(point))


def search(wanted: Search, stages: Stages) -> list[Run]:
    """Train at every point of the grid that has no result yet, and write tables and picture.

    Returns:
        The runs, the one nearest to `fem` first.

    Raises:
        UserError: If it cannot be done, or the folder holds something else.
    """
    started = datetime.now(UTC)
    solver, *_ = (wanted.solver(point) for point in wanted.points)
    check_load(solver, wanted.load)
    definition = _definition(wanted, solver)
    check_kept_folder(wanted.out / SEARCH_FILE, definition, job="grid search")
    with stages.stage("mesh"):
        problem = Problem(finger_mesh(wanted.design, settings=wanted.mesh), wanted.material, wanted.load)
    wanted.out.mkdir(parents=True, exist_ok=True)
    with locked(wanted.out):
        write_json(wanted.out / SEARCH_FILE, definition)
        finished = {point: wanted.folder(point) / RESULT_FILE for point in wanted.points}
        results = {point: Run.load(path) for point, path in finished.items() if path.exists()}
        if missing := [point for point in wanted.points if point not in results]:
            results |= _trained(wanted, missing, problem, stages)
        runs = ranked(list(results.values()))
        write_runs(wanted.out / "gridsearch.csv", runs)
        with stages.stage("picture"):
            from compare.gridsearch.chart import draw_grid

            draw_grid(wanted.out / "gridsearch.png", runs=runs)
        best = best_of(runs)
        write_json(
            wanted.out / "gridsearch.json",
            {
                **definition,
                "learning_rates": list(wanted.learning_rates),
                "bc_weights": list(wanted.bc_weights),
                "ranked_by": "rel_l2_displacement: relative L2 difference from fem on the same mesh",
                "best": best and asdict(best),
                "runs": [asdict(run) for run in runs],
                "started": started.isoformat(timespec="seconds"),
                "seconds": {name: round(seconds, 2) for name, seconds in stages.seconds.items()},
                "problem_sha256": problem.digest,
                "machine": machine(),
            },
        )
    return runs


def _definition(wanted: Search, solver: Solver) -> dict[str, Any]:
    """Everything that the result of a run depends on, but for its point of the grid."""
    searched = {"learning_rate", "bc_weight"}
    return {
        "schema": 1,
        "design": wanted.design.model_dump(),
        "mesh": wanted.mesh.model_dump(),
        "material": wanted.material.model_dump(),
        "load": wanted.load.model_dump(mode="json"),
        "solver": {key: value for key, value in solver.settings().items() if key not in searched},
        "versions": package_versions(),
        "program_sha256": sources_digest(["compare.gridsearch.training_run", "geometry", "solvers"]),
    }


def _trained(wanted: Search, points: Sequence[Point], problem: Problem, stages: Stages) -> dict[Point, Run]:
    """Train at points of the grid, each in a process of its own."""
    with stages.stage("fem") as progress:
        reference = Reference.of(make_solver("fem").solve(problem, progress))
    mesh = wanted.out / "mesh.npz"
    problem.mesh.save(mesh)
    tasks = {
        point.name: Task(
            point=point,
            settings=wanted.settings,
            mesh=mesh,
            material=wanted.material,
            load=wanted.load,
            reference=reference,
            folder=wanted.folder(point),
            threads=wanted.threads,
        )
        for point in points
    }

    def run_of(name: str, answer: Run | ProcessFailed) -> Run:
        if isinstance(answer, ProcessFailed):
            said = f"its process ended with exit code {answer.exit_code}"
            return Run(tasks[name].point, FAILED, said)
        return answer

    answers = in_stages(
        train,
        tasks,
        processes=wanted.processes,
        stages=stages,
        kind="runs",
        note=lambda name, answer: run_note(run_of(name, answer)),
    )
    return {tasks[name].point: run_of(name, answer) for name, answer in answers}

"""The paper's grid search: a sweep over two settings of its network, ranked by the distance from `fem`."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict

from rich.table import Table

from pinnray.comparison.evaluation.definition import job_definition
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.drawing.drawn_finger import finger_from
from pinnray.runtime.atomic import write_json
from pinnray.runtime.stages import Stages
from pinnray.runtime.tables import NONE, Cell, terminal_table, write_csv
from pinnray.solvers.problem import Problem
from pinnray.studies.gridsearch.chart import draw_grid
from pinnray.studies.gridsearch.training_run import GridPoint, TrainingRun, best_of
from pinnray.studies.sweep.job import StudyJob
from pinnray.studies.sweep.quantities import TRAINING, quantity_heading
from pinnray.studies.sweep.study import Range, Study, Value, physics_of
from pinnray.studies.sweep.sweep import run_sweep

SOLVER = "pinn-std"


def grid_study(
    name: str,
    settings: Mapping[str, Value],
    physics: Mapping[str, Value],
    learning_rates: Sequence[float],
    bc_weights: Sequence[float],
) -> Study:
    """The study of a grid search.

    Args:
        name: The finger's.
        settings: The other settings of `pinn-std`, its preset `paper` among them.
        physics: Material and load, by the names of a study.
        learning_rates: Learning rates of the optimiser.
        bc_weights: Weights of the boundary conditions in the loss, MPa/mm².
    """
    return Study(
        name=name[:48],
        solver=SOLVER,
        settings=dict(settings),
        sampling="grid",
        fixed=dict(physics),
        varied={
            f"{SOLVER}.learning_rate": Range(values=tuple(learning_rates)),
            f"{SOLVER}.bc_weight": Range(values=tuple(bc_weights)),
        },
    )


def search_grid(
    job: StudyJob[Study], stages: Stages | None = None, formats: Sequence[str] = ()
) -> list[TrainingRun]:
    """Train at every point of the grid that has no result yet, and write tables and picture.

    Args:
        job: Of a `grid_study`.
        stages: Shows the progress; None shows nothing.
        formats: Formats of the picture besides PNG.

    Returns:
        The runs, the one nearest to `fem` first; losses do not compare between weights.

    Raises:
        UserError: If the search cannot be done, or the folder holds something else.
    """
    stages = stages or Stages(quiet=True)
    task = job.task(0, {})
    finger, (material, load) = finger_from(task.definition), physics_of(task.physics)
    sweep = run_sweep(job, stages)
    problem = Problem(finger_mesh(finger, settings=task.mesh), material, load)
    points = [GridPoint(*map(float, sample.values())) for sample in sweep.samples]
    runs = [TrainingRun.of(points[each.number], each) for each in sweep.measurements]
    runs.sort(key=lambda run: run.distance)
    write_csv(job.out / "gridsearch.csv", [_row(rank, run) for rank, run in enumerate(runs, start=1)])
    with stages.stage("picture"):
        draw_grid(runs).save(job.out / "gridsearch.png", formats)
    best = best_of(runs)
    rates, weights = (values.values for values in job.study.varied.values())
    content = {
        **job_definition(finger, task.mesh, material, load, __name__),
        "solver": task.settings,
        "learning_rates": rates,
        "bc_weights": weights,
        "ranked_by": "rel_l2_displacement: relative L2 difference from fem on the same mesh",
        "best": best and asdict(best),
        "runs": [asdict(run) for run in runs],
        "problem_sha256": problem.digest,
        **stages.record(),
    }
    write_json(job.out / "gridsearch.json", content)
    return runs


def _row(rank: int, run: TrainingRun) -> dict[str, Cell]:
    row: dict[str, Cell] = {
        "rank": rank,
        "learning_rate": run.point.learning_rate,
        "bc_weight_MPa_per_mm2": run.point.bc_weight,
        "status": run.status,
    }
    measured = run.measured or {}
    row |= {quantity_heading(name): measured.get(name, "") for name in TRAINING}
    return row | {"message": run.message}


def runs_table(runs: Sequence[TrainingRun]) -> Table:
    """The runs for the terminal."""
    rows = []
    for run in runs:
        numbers = [NONE] * 5
        if measured := run.measured:
            numbers = [
                f"{100 * run.distance:.3g}",
                f"{1 + measured['rel_energy']:.3g}",
                f"{100 * measured['boundary_violation']:.3g}",
                f"{measured['loss']:.3g}",
                f"{measured['seconds']:.0f}",
            ]
        else:
            numbers[0] = run.status
        rows.append([f"{run.point.learning_rate:g}", f"{run.point.bc_weight:g}", *numbers])
    return terminal_table(
        "Runs by their distance from fem",
        [
            "learning\nrate",
            "BC weight\nMPa/mm²",
            "L²\n%",
            "energy\nof fem's",
            "violation\n%",
            "loss\nMPa",
            "time\ns",
        ],
        rows,
        caption="L²: relative difference of the displacement field from fem on the same mesh. Violation: of "
        "base or load, over the stroke. Losses do not compare between weights; the order of short trainings "
        "need not be that of long ones.",
    )

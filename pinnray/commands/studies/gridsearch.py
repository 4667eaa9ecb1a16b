"""Repeat the paper's grid search."""

from math import isfinite
from pathlib import Path
from typing import Any

from rich.console import Console

from pinnray.commands.quiet import quietable
from pinnray.options.shared import (
    FingerOptions,
    OptionalOutputPath,
    PhysicsOptions,
    SolverOptions,
    going_on_from,
    read_formats,
    read_processes,
)
from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import NOT_CONVERGED, say

SOLVER = "pinn-std"
SHORT = 2_000
"""Default epochs of a run: minutes on a CPU with the usual mesh."""

SEARCHED = {"learning_rate": "--learning-rates", "bc_weight": "--bc-weights"}


@quietable
def command(
    *,
    finger: FingerOptions = FingerOptions(),
    physics: PhysicsOptions = PhysicsOptions(),
    options: SolverOptions = SolverOptions(),
    learning_rates: str = "1e-4,1e-3,1e-2",
    bc_weights: str = "0.1,1,10,100,1000",
    epochs: int | None = None,
    processes: int | None = None,
    pictures: str = "",
    out: OptionalOutputPath = None,
) -> int:
    """Repeat the paper's grid search for the learning rate and the weight of the boundary conditions.

    Trains the paper's network at every point of the grid, each in a process of its own, and ranks the runs by
    their distance from `fem`. Finished runs are kept: the same command again goes on where it was stopped.

    Args:
        learning_rates: Learning rates, separated by commas.
        bc_weights: Weights of the boundary conditions in the loss, MPa/mm².
        epochs: Epochs of every run; default 2,000 (short), or 60,000 with --preset paper.
        processes: Runs trained at a time; default: one per core.
        pictures: Formats of the picture besides PNG (default: none), separated by commas: svg, pdf.
        out: Output folder; default out/gridsearch-DESIGN.
    """
    from pinnray.geometry.mesh.settings import MeshSettings
    from pinnray.runtime.stages import Stages
    from pinnray.solvers.registry import make_solver
    from pinnray.studies.gridsearch.search import grid_study, runs_table, search_grid
    from pinnray.studies.gridsearch.training_run import FAILED, best_of
    from pinnray.studies.sweep.job import StudyJob

    design, sizes = finger.read(options.preset)
    mesh = sizes or MeshSettings()  # a run is given the finger's section, without the mesh of its file
    finger.check_cost(design, mesh, [make_solver("fem")])
    physics.read(options.preset)  # or says what is wrong with it
    rates, weights = read_values("learning-rates", learning_rates), read_values("bc-weights", bc_weights)
    study = grid_study(
        design.name, read_settings(options, epochs), physics.values(options.preset), rates, weights
    )
    physics.check_law([study.made_solver()])
    job = StudyJob(
        study,
        Path(),
        out or Path("out") / f"gridsearch-{design.name}",
        read_processes(processes),
        finger=design,
        mesh=mesh,
        kind="grid search",
    )
    formats = read_formats(pictures)
    with going_on_from(job.out), Stages() as stages:
        runs = search_grid(job, stages, formats)
    Console().print(runs_table(runs))
    for name in ("gridsearch.csv", "gridsearch.json", "gridsearch.png"):
        print(job.out / name)
    failed = [run for run in runs if run.status == FAILED]
    for run in failed:
        say(
            f"error: learning rate {run.point.learning_rate:g} with weight {run.point.bc_weight:g} failed, "
            f"and is tried again by the same command: {run.message}"
        )
    return 0 if best_of(runs) and not failed else NOT_CONVERGED


def read_settings(options: SolverOptions, epochs: int | None) -> dict[str, Any]:
    """The settings of the paper's network that all runs share."""
    if options.preset not in (None, "paper"):
        raise UserError(f"--preset {options.preset}: the search is for the settings of the preset paper")
    keys = [text.partition("=")[0].removeprefix(f"{SOLVER}.") for text in options.solver_set]
    if searched := next((key for key in keys if key in SEARCHED), None):
        raise UserError(
            f"{SOLVER}.{searched} is what is searched for; give its values with {SEARCHED[searched]}"
        )
    texts = options.solver_set
    if epochs is None and options.preset is None and "epochs" not in keys:
        epochs = SHORT
    if epochs is not None:
        texts = (*texts, f"{SOLVER}.epochs={epochs}")
    (solver,) = options.model_copy(update={"preset": "paper", "solver_set": texts}).read(SOLVER)
    return {key: value for key, value in solver.settings().items() if key not in SEARCHED}


def read_values(option: str, text: str) -> tuple[float, ...]:
    """Different positive numbers from a text with commas between them."""
    try:
        values = tuple(float(word) for word in text.split(","))
    except ValueError:
        raise UserError(
            f"--{option} {text}: give numbers with commas between them, such as 1e-4,1e-3"
        ) from None
    if not all(value > 0 and isfinite(value) for value in values) or len(set(values)) < len(values):
        raise UserError(f"--{option} {text}: give different numbers above 0")
    return values

"""Reading of the options of `pinnray gridsearch`."""

from dataclasses import replace
from math import isfinite

from compare.commands.options import SolverOptions
from compare.runtime.provenance import cores
from geometry.errors import UserError

SOLVER = "pinn-std"
SHORT = 2_000
"""Default epochs of a run: minutes on a CPU with the usual mesh."""

SEARCHED = {"learning_rate": "--learning-rates", "bc_weight": "--bc-weights"}


def read_settings(options: SolverOptions, epochs: int | None) -> dict[str, object]:
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
    (solver,) = replace(options, preset="paper", solver_set=texts).read(SOLVER)
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


def read_processes(processes: int | None) -> int:
    """Processes at a time: as many as there are cores if None."""
    count = cores() if processes is None else processes
    if count < 1:
        raise UserError(f"--processes {count}: give a whole number from 1")
    return count

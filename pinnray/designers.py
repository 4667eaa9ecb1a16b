"""Functions of the front door for designers: sweep, predict, optimise.

The worker processes run a calling script once more: in a script, what starts a sweep or a search must stand
under `if __name__ == "__main__":`.
"""

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from compare.runtime.provenance import cores
from geometry.errors import UserError

if TYPE_CHECKING:
    import pandas as pd

    from studies.optimum.search import Optimum


def sweep(study: str | Path, *, out: str | Path, processes: int | None = None) -> "pd.DataFrame":
    """Solve the samples of a study; see `pinnray sweep`.

    Args:
        study: TOML file.
        out: Folder that keeps each result; the same call goes on where it was stopped.
        processes: Worker processes; None means one per core.

    Returns:
        A row for every finished sample, with units in the headings, such as `force_N`. Warns of samples
        whose body goes through itself, or whose load or material looks like another unit.

    Raises:
        UserError: If the study cannot be run, or the folder holds another one.
    """
    from studies.sweep.job import StudyJob
    from studies.sweep.study import load_study
    from studies.sweep.sweep import run_sweep
    from studies.sweep.tables import sample_table

    file = Path(study)
    done = run_sweep(StudyJob(load_study(file), file.parent, Path(out), processes or cores()))
    for remark in done.remarks:
        warnings.warn(remark, stacklevel=2)
    return sample_table(done)


def predict(sweep: str | Path, fingers: Sequence[Mapping[str, object]]) -> "pd.DataFrame":
    """Predict the quantities of fingers from a sweep; see `pinnray predict`.

    Args:
        sweep: Folder of a sweep.
        fingers: Values of every parameter that the sweep varies.

    Returns:
        A row for every finger: each quantity, such as `force_N`, and the ends of its 95 % interval,
        `force_N_low` and `force_N_high`.

    Raises:
        UserError: If the sweep has too few samples, or a finger is outside its ranges.
    """
    from studies.emulator.emulator import prediction_table
    from studies.emulator.store import emulator_of

    emulator = emulator_of(Path(sweep))
    read = [emulator.inputs.read({name: str(value) for name, value in each.items()}) for each in fingers]
    for place, finger in enumerate(read):
        if fault := emulator.inputs.fault(finger):
            raise UserError(f"finger {place}: {fault}")
    return prediction_table(emulator, read, emulator.predict(read))


def optimise(question: str | Path, *, out: str | Path, processes: int | None = None) -> "Optimum":
    """Search for the Pareto front of a question; see `pinnray optimise`.

    Args:
        question: TOML file.
        out: Folder that keeps each run; the same call goes on where it was stopped.
        processes: Worker processes; None means one per core.

    Raises:
        UserError: If the question cannot be asked, the folder holds another one, or nothing is allowed.
    """
    from studies.optimum.question import load_question
    from studies.optimum.search import search_front
    from studies.sweep.job import StudyJob

    file = Path(question)
    return search_front(StudyJob(load_question(file), file.parent, Path(out), processes or cores()))

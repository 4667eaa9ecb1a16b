"""Functions of the front door for designers: sweep, predict, predict_field, optimise.

The worker processes run a calling script once more: in a script, what starts a sweep or a search must stand
under `if __name__ == "__main__":`.
"""

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pinnray.geometry.drawing.drawn_finger import DrawnFinger
from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.finger.parameters import SYMBOLS, Parameters, by_parameter_name, unknown_parameter
from pinnray.runtime.errors import UserError
from pinnray.runtime.machine import process_count
from pinnray.runtime.text_files import as_path, output_folder
from pinnray.solvers.load import Physics

if TYPE_CHECKING:
    import pandas as pd

    from pinnray.studies.fields.prediction import PredictedField
    from pinnray.studies.optimum.search import Optimum
    from pinnray.studies.sweep.study import Study


def sweep(
    study: str | Path | Mapping[str, Any],
    *,
    design: str | Path | Finger = "default",
    solver: str = "fem",
    size: float = 0.5,
    samples: int | None = None,
    sampling: Literal["grid", "sobol"] | None = None,
    seed: int = 0,
    out: str | Path | None = None,
    processes: int | None = None,
    progress: bool | None = None,
    **fixed: Any,
) -> "pd.DataFrame":
    """Solve many fingers: `sweep({"rib_count": [4, 6], "young": [3, 5]}, stroke=8)`; see `pinnray sweep`.

    Args:
        study: The values of each parameter of finger, material or load that is varied: a list of them, or
            `{"from": LOW, "to": HIGH}` with `samples`; or the TOML file of a study, which says all the rest.
        design: The finger from which they differ; of a drawn one only material and load can be varied.
        solver: Name of the solver.
        size: Largest element in walls and ribs, mm.
        samples: Number of samples between the ends of the ranges.
        sampling: `grid` (every combination) or `sobol`; if None a grid of lists, else `sobol`.
        seed: Of the samples.
        out: Folder that keeps each result; the same call goes on where it was stopped. None keeps nothing.
        processes: Worker processes; None means one per core.
        progress: Whether to show the stages; if None in a notebook only.
        fixed: Parameters with one value for all fingers.

    Returns:
        A row for every finished sample, with units in the headings, such as `force_N`. Warns of samples
        whose body goes through itself, or whose load or material looks like another unit.

    Raises:
        UserError: If the study cannot be run, or the folder holds another one.
    """
    from pinnray.runtime.stages import shown_stages
    from pinnray.studies.sweep.job import StudyJob
    from pinnray.studies.sweep.study import Study
    from pinnray.studies.sweep.sweep import run_sweep
    from pinnray.studies.sweep.tables import sample_table

    finger: Finger | None = None
    folder = Path()
    if isinstance(study, Mapping):
        given = {"solver": solver, "mesh_size": size, "samples": samples, "seed": seed}
        read, finger = _study(Study, study, design, sampling, given, fixed)
    else:
        if not isinstance(study, str | Path):
            raise UserError(
                f"give a dictionary such as {{'rib_count': [4, 6]}} or a study's file, not {study!r}"
            )
        file = Path(study)
        if fixed or samples is not None or sampling is not None:
            said = next(iter(fixed), "samples" if samples is not None else "sampling")
            raise UserError(f"{said} is said by the study in {file}; change it there")
        read, folder = Study.load(file), file.parent
    with output_folder(out) as where, shown_stages(progress) as stages:
        job = StudyJob(read, folder, Path(where), process_count(processes, "processes ="), finger=finger)
        done = run_sweep(job, stages)
    for remark in done.remarks:
        warnings.warn(remark, stacklevel=2)
    return sample_table(done)


def predict(
    sweep: str | Path, fingers: "Mapping[str, object] | Sequence[Mapping[str, object]] | pd.DataFrame"
) -> "pd.DataFrame":
    """Predict the quantities of fingers from a sweep; see `pinnray predict`.

    Args:
        sweep: Folder of a sweep.
        fingers: Values of every parameter that the sweep varies, of one finger or of several:
            dictionaries, or a table with a column for each.

    Returns:
        A row for every finger, with each quantity, such as `force_N`, and the ends of its 95 % interval,
        `force_N_low` and `force_N_high`.

    Raises:
        UserError: If the sweep has too few samples, or a finger is outside its ranges.
    """
    from pinnray.studies.emulator.emulator import prediction_table
    from pinnray.studies.emulator.store import emulator_of

    several: object = [fingers] if isinstance(fingers, Mapping) else fingers
    if to_dict := getattr(fingers, "to_dict", None):
        several = to_dict("records")
    if not isinstance(several, Sequence) or not all(isinstance(each, Mapping) for each in several):
        raise UserError(f"the fingers are dictionaries such as {{'rib_count': 5}}, not {fingers!r}")
    emulator = emulator_of(as_path(sweep, "the sweep"))
    read = [
        emulator.inputs.finger({name: str(value) for name, value in each.items()}, f"finger {place}: ")
        for place, each in enumerate(several)
    ]
    return prediction_table(emulator, read, emulator.predict(read))


def predict_field(sweep: str | Path, finger: Mapping[str, object], stroke: float) -> "PredictedField":
    """Predict the whole field of one finger from a sweep that has kept fields; see `pinnray explore`.

    Args:
        sweep: Folder of a sweep, whose study has `strokes`.
        finger: Values of every parameter that the sweep varies.
        stroke: Stroke of the indenter, mm.

    Raises:
        UserError: If the sweep has no fields or too few, or the finger or stroke is outside its ranges.
    """
    from pinnray.studies.fields.store import fields_of

    emulator = fields_of(as_path(sweep, "the sweep"))
    read = emulator.inputs.read({name: str(value) for name, value in finger.items()})
    if fault := emulator.fault(read, stroke):
        raise UserError(fault)
    return emulator.predict(read, stroke)


def optimise(
    question: str | Path | Mapping[str, Any],
    *,
    out: str | Path | None = None,
    processes: int | None = None,
    progress: bool | None = None,
) -> "Optimum":
    """Search for the Pareto front of a question; see `pinnray optimise`.

    Args:
        question: TOML file, or what it would hold: a dictionary with `varied`, `objectives` and so on.
        out: Folder that keeps each run; the same call goes on where it was stopped. None keeps nothing.
        processes: Worker processes; None means one per core.
        progress: Whether to show the stages; if None in a notebook only.

    Raises:
        UserError: If the question cannot be asked, the folder holds another one, or nothing is allowed.
    """
    from pinnray.runtime.stages import shown_stages
    from pinnray.studies.optimum.question import Question
    from pinnray.studies.optimum.search import search_front
    from pinnray.studies.sweep.job import StudyJob

    if isinstance(question, Mapping):
        read, folder = Question(**{"name": "question", **question}), Path()
    else:
        file = as_path(question, "the question")
        read, folder = Question.load(file), file.parent
    with output_folder(out) as where, shown_stages(progress) as stages:
        job = StudyJob(read, folder, Path(where), process_count(processes, "processes ="))
        return search_front(job, stages)


def _study(
    kind: type["Study"],
    varied: Mapping[str, Any],
    design: str | Path | Finger,
    sampling: str | None,
    given: Mapping[str, Any],
    fixed: Mapping[str, Any],
) -> tuple["Study", Finger | None]:
    """A study of parameters in the words of Python, and the finger if it is no preset or file."""
    ranges = {name: _range(name, values) for name, values in by_parameter_name(varied, Physics).items()}
    words = by_parameter_name(fixed, Physics)
    for name in words:
        if SYMBOLS.get(name, name) not in Parameters.model_fields and name not in Physics.model_fields:
            raise UserError(unknown_parameter(name, Parameters, Physics, besides=tuple(given)))
    if sampling is None:
        sampling = "grid" if all("values" in each for each in ranges.values()) else "sobol"
    finger = design if isinstance(design, Design | DrawnFinger) else None
    if finger is None and not isinstance(design, str | Path):
        raise UserError(f"{design!r} is no design; give one that is made, the name of a preset or a file")
    named = {} if finger is not None else {"design": str(design)}
    known = {name: value for name, value in given.items() if value is not None}
    content = {"name": "sweep", "sampling": sampling, "fixed": words, "varied": ranges, **named, **known}
    return kind(**content), finger


def _range(name: str, values: object) -> Mapping[str, Any]:
    if isinstance(values, Mapping):
        return values
    if isinstance(values, str) or not hasattr(values, "__iter__"):
        raise UserError(
            f"{name}: give a list of values, such as [4, 6], or {{'from': LOW, 'to': HIGH}}, not {values!r}"
        )
    return {"values": [each.item() if hasattr(each, "item") else each for each in values]}

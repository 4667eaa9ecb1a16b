"""Random fingers, drawings, settings, materials and loads: each a valid result or one line, in bounded time.

`python -m benchmarks.reliability.inputs COUNT [SOLVER]` keeps the counts; needs Hypothesis.
"""

import math
import multiprocessing
import resource
import sys
import tempfile
import time
import warnings
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from unittest.mock import patch

from benchmarks.tables import keep_rows, kept_rows
from pinnray.geometry.cache import drawn_finger
from pinnray.geometry.drawing.description import load_description
from pinnray.runtime.errors import UserError
from pinnray.studies.sweep.measurement import Measurement, measured

if TYPE_CHECKING:
    from benchmarks.reliability.strategies import Given

ROWS = Path(__file__).with_name("inputs.csv")
BLOCK = 250
"""Inputs of a process; their seed is the number of the block."""
LONGEST_S = 60.0
"""Time that a coarse finger may take, s."""


class Row(NamedTuple):
    """Counts of the inputs of one solver by their end; seconds of the slowest, bytes of the largest."""

    solver: str
    inputs: int
    done: int
    not_converged: int
    refused: int
    wrong: int
    slowest: float
    peak: int


class Outcomes(NamedTuple):
    """Number of inputs by state, times, s, largest memory, bytes, and faults with an input each."""

    states: Counter[str]
    slowest: float
    peak: int
    wrong: dict[str, str]


def _one_line(error: UserError) -> str:
    """The text of a refusal, in place of its `__str__`: measurements join lines, which would hide them."""
    text = Exception.__str__(error)
    if "\n" in text:
        raise RuntimeError(f"a refusal of several lines: {text}")
    return text


def answer_to(given: "Given", folder: Path) -> Measurement:
    """The end of an input; a drawing is read as `--section` does it, through a file in the folder."""
    task = given.task
    with patch.object(UserError, "__str__", _one_line):
        try:
            if given.sketch is not None:
                path = folder / "sketch.svg"
                path.write_text(given.sketch.svg, encoding="utf-8")
                finger = drawn_finger(path, load_description(None, given.sketch.lines), cache_dir=folder)
                task = replace(task, definition=finger.definition())
            return measured(task)
        except UserError as error:
            return Measurement(0, "refused", str(error), 0.0)
        except Exception as error:
            return Measurement(0, "failed", f"{type(error).__name__}: {error}", 0.0)


def fault_of(answer: Measurement, seconds: float) -> str:
    """The broken promise in the end of an input; empty if there is none."""
    # Of a section without cavities these quantities are infinite.
    free = [name for name in ("thinnest_wall", "narrowest_gap") if answer.values.get(name) == math.inf]
    bad = [name for name, value in answer.values.items() if not math.isfinite(value) and name not in free]
    faults = {
        f"an error of the program: {answer.message}": answer.state == "failed",
        "no word of explanation": not answer.message.strip(),
        f"a message for programmers: {answer.message}": answer.state == "refused"
        and "Error:" in answer.message,
        f"not finite: {', '.join(bad)}, though it is {answer.state}": bool(bad),
        f"it took more than {LONGEST_S:.0f} s": seconds > LONGEST_S,
    }
    return next((said for said, wrong in faults.items() if wrong), "")


def tried(count: int, solver: str = "fem", seed: int = 0) -> Outcomes:
    """Try random inputs to the end, also after a fault."""
    from hypothesis import HealthCheck, Phase, given, settings
    from hypothesis import seed as seeded

    from benchmarks.reliability.strategies import Given, inputs

    states, wrong, times = Counter[str](), dict[str, str](), [0.0]
    quick = {"database": None, "deadline": None, "phases": [Phase.generate]}
    with tempfile.TemporaryDirectory() as folder:

        @seeded(seed)
        @settings(max_examples=count, suppress_health_check=list(HealthCheck), **quick)
        @given(inputs(solver))
        def one(each: Given) -> None:
            started = time.perf_counter()
            answer = answer_to(each, Path(folder))
            times.append(time.perf_counter() - started)
            states[answer.state] += 1
            if (fault := fault_of(answer, times[-1])) and fault not in wrong:
                wrong[fault] = repr(each)
                print(fault, each, sep="\n  ", flush=True)

        one()
    return Outcomes(states, max(times), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024, wrong)


def block(solver: str, seed: int) -> Outcomes:
    """The outcomes of a block of inputs, without the warnings of libraries."""
    warnings.simplefilter("ignore")
    return tried(BLOCK, solver, seed)


def main(count: int, solver: str = "fem") -> None:
    """Try random inputs of a solver in blocks, each in a process of its own, and keep the counts."""
    others = [each for each in kept_rows(ROWS, Row) if each.solver != solver]
    blocks = range(-(-count // BLOCK))
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        found = pool.starmap(block, [(solver, seed) for seed in blocks], chunksize=1)
    states = sum((each.states for each in found), Counter[str]())
    wrong = {said for each in found for said in each.wrong}
    ends = [states[state] for state in ("done", "not converged", "refused")]
    worst = (max(each.slowest for each in found), max(each.peak for each in found))
    row = Row(solver, states.total(), *ends, len(wrong), *worst)  # type: ignore[call-arg]
    keep_rows(ROWS, Row, [row, *others])
    print(*row, flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]), *sys.argv[2:])

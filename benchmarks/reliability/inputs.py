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
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from unittest.mock import patch

from benchmarks.tables import keep_rows, kept_rows
from compare.sweep.measurement import Measurement, measured
from geometry.cache import drawn_finger
from geometry.drawing.description import load_description
from geometry.errors import UserError

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


@dataclass
class Outcomes:
    """Number of inputs by state, the longest time, s, the memory, bytes, and faults with an input each."""

    states: Counter[str] = field(default_factory=Counter)
    slowest: float = 0.0
    peak: int = 0
    wrong: dict[str, str] = field(default_factory=dict)

    def add(self, other: "Outcomes") -> None:
        """Count others with these."""
        self.states += other.states
        self.slowest, self.peak = max(self.slowest, other.slowest), max(self.peak, other.peak)
        self.wrong |= other.wrong


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
    """What is wrong with the end of an input; empty if nothing is."""
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
    """Try random inputs, without stopping at what is wrong."""
    from hypothesis import HealthCheck, Phase, given, settings
    from hypothesis import seed as seeded

    from benchmarks.reliability.strategies import Given, inputs

    found = Outcomes()
    quick = {"database": None, "deadline": None, "phases": [Phase.generate]}
    with tempfile.TemporaryDirectory() as folder:

        @seeded(seed)
        @settings(max_examples=count, suppress_health_check=list(HealthCheck), **quick)
        @given(inputs(solver))
        def one(each: Given) -> None:
            started = time.perf_counter()
            answer = answer_to(each, Path(folder))
            seconds = time.perf_counter() - started
            found.states[answer.state] += 1
            found.slowest = max(found.slowest, seconds)
            if (fault := fault_of(answer, seconds)) and fault not in found.wrong:
                found.wrong[fault] = repr(each)
                print(fault, each, sep="\n  ", flush=True)

        one()
    found.peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return found


def main(count: int, solver: str = "fem") -> None:
    """Try random inputs of a solver in blocks, each in a process of its own, and keep the counts."""
    found = Outcomes()
    others = [each for each in kept_rows(ROWS, Row) if each.solver != solver]
    for seed in range(-(-count // BLOCK)):
        with ProcessPoolExecutor(
            1,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=warnings.simplefilter,
            initargs=("ignore",),
        ) as pool:
            found.add(pool.submit(tried, BLOCK, solver, seed).result())
        ends = [found.states[state] for state in ("done", "not converged", "refused")]
        row = Row(solver, found.states.total(), *ends, len(found.wrong), found.slowest, found.peak)
        keep_rows(ROWS, Row, [row, *others])
        print(*row, flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]), *sys.argv[2:])

"""Random fingers, drawings, settings, materials and loads: each a valid result or one line, in bounded time.

`python -m benchmarks.reliability.inputs COUNT [SOLVER]` keeps the counts; needs Hypothesis.
"""

import csv
import math
import multiprocessing
import resource
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from unittest.mock import patch

from compare.sweep import measurement
from compare.sweep.measurement import Measurement, measured
from geometry.atomic import write_text
from geometry.cache import drawn_finger
from geometry.drawing.description import load_description
from geometry.errors import UserError

if TYPE_CHECKING:
    from benchmarks.reliability.strategies import Given

ROWS = Path(__file__).with_name("inputs.csv")

BLOCK = 250
"""Inputs of a process; their seed is the number of the block."""

WITHOUT = ("thinnest_wall", "narrowest_gap")
"""Quantities that are infinite where a section has no cavity."""

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
    """What came of the inputs that were tried.

    Attributes:
        states: Number of inputs by the state of their measurement.
        slowest: Longest time of one, s.
        peak: Largest memory of the process, bytes.
        wrong: What was not as promised, by the sentence, with an input that shows it.
    """

    states: Counter[str] = field(default_factory=Counter)
    slowest: float = 0.0
    peak: int = 0
    wrong: dict[str, str] = field(default_factory=dict)

    def add(self, other: "Outcomes") -> None:
        """Count others with these."""
        self.states += other.states
        self.slowest, self.peak = max(self.slowest, other.slowest), max(self.peak, other.peak)
        self.wrong |= other.wrong


def answer_to(given: "Given", folder: Path) -> Measurement:
    """The end of an input; a drawing is read as `--section` does it, through a file in the folder.

    An error of the program is told with the place where it was raised.
    """
    task = given.task
    with traced() as places:
        if given.sketch is not None:
            path = folder / "sketch.svg"
            path.write_text(given.sketch.svg, encoding="utf-8")
            try:
                description = load_description(None, given.sketch.lines)
                task = replace(
                    task, definition=drawn_finger(path, description, cache_dir=folder).definition()
                )
            except UserError as error:
                return Measurement(0, "refused", str(error), 0.0)
            except Exception as error:
                places.append(traceback.format_exc())
                return Measurement(0, "failed", f"{type(error).__name__}: {error} {places[-1]}", 0.0)
        answer = measured(task)
    if answer.state == "failed":
        return replace(answer, message=f"{answer.message} {' '.join(places)}")
    return answer


STEPS = ("broken_rule", "finger_from", "material_of", "load_of", "finger_mesh", "make_solver", "quantities")
"""What a measurement calls, one after another."""


@contextmanager
def traced() -> Iterator[list[str]]:
    """A list for the tracebacks of a task's errors, of which its answer tells only the last line.

    A refusal of several lines, which the answer would join, is an error, too.
    """
    places: list[str] = []

    def told(step: Callable[..., Any]) -> Callable[..., Any]:
        def tried(*given: Any, **named: Any) -> Any:
            try:
                return step(*given, **named)
            except UserError as error:
                if "\n" in str(error):
                    raise RuntimeError(f"a refusal of several lines: {error}") from error
                raise
            except Exception:
                places.append(traceback.format_exc())
                raise

        return tried

    with ExitStack() as patches:
        for name in STEPS:
            patches.enter_context(patch.object(measurement, name, told(getattr(measurement, name))))
        yield places


def fault_of(given: "Given", folder: Path) -> tuple[Measurement, str]:
    """Try an input; the sentence says what is wrong with its end, and is empty if nothing is."""
    started = time.perf_counter()
    answer = answer_to(given, folder)
    seconds = time.perf_counter() - started
    if answer.state == "failed":
        return answer, f"an error of the program: {answer.message}"
    if not answer.message.strip():
        return answer, "no word of explanation"
    if "\n" in answer.message:
        return answer, f"more than one line: {answer.message}"
    if answer.state == "refused" and "Error:" in answer.message:
        return answer, f"a message for programmers: {answer.message}"
    bad = [name for name, value in answer.values.items() if not math.isfinite(value)]
    if bad := [name for name in bad if not (name in WITHOUT and answer.values[name] == math.inf)]:
        return answer, f"no finite {bad[0]}, though it is {answer.state}"
    if seconds > LONGEST_S:
        return answer, f"it took {seconds:.0f} s"
    return answer, ""


def tried(count: int, solver: str = "fem", seed: int = 0) -> Outcomes:
    """Try random inputs, without stopping at what is wrong."""
    from hypothesis import HealthCheck, Phase, given, settings
    from hypothesis import seed as seeded

    from benchmarks.reliability.strategies import Given, inputs

    found = Outcomes()

    with tempfile.TemporaryDirectory() as folder:

        @seeded(seed)
        @settings(
            max_examples=count,
            database=None,
            deadline=None,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        @given(inputs(solver))
        def one(each: Given) -> None:
            started = time.perf_counter()
            answer, fault = fault_of(each, Path(folder))
            found.states[answer.state] += 1
            found.slowest = max(found.slowest, time.perf_counter() - started)
            if fault and fault not in found.wrong:
                found.wrong[fault] = repr(each)
                print(fault, each, sep="\n  ", flush=True)

        one()
    found.peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return found


def block(solver: str, seed: int) -> Outcomes:
    """The outcomes of a block of inputs, without the warnings of libraries."""
    warnings.simplefilter("ignore")
    return tried(BLOCK, solver, seed)


def kept_rows() -> list[Row]:
    """The counts as they were kept."""
    if not ROWS.exists():
        return []
    with ROWS.open(encoding="utf-8", newline="") as file:
        return [
            Row(solver, *map(int, counts), float(slowest), int(peak))
            for solver, *counts, slowest, peak in list(csv.reader(file))[1:]
        ]


def main(count: int, solver: str = "fem") -> None:
    """Try random inputs of a solver in blocks, and keep the counts after each."""
    found = Outcomes()
    rows = [each for each in kept_rows() if each.solver != solver]
    for seed in range(-(-count // BLOCK)):
        with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
            found.add(pool.submit(block, solver, seed).result())
        ends = [found.states[state] for state in ("done", "not converged", "refused")]
        row = Row(solver, found.states.total(), *ends, len(found.wrong), found.slowest, found.peak)
        lines = [Row._fields, row, *rows]
        write_text(ROWS, "".join(",".join(map(str, line)) + "\n" for line in lines))
        print(*row, flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]), *sys.argv[2:])

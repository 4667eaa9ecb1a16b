"""Random fingers, materials and loads: each gives a valid result, or one line, in bounded time and memory.

`python -m benchmarks.reliability.inputs COUNT [SOLVER]` keeps the counts; needs Hypothesis.
"""

import csv
import math
import resource
import sys
import time
import warnings
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from compare.sweep.measurement import Measurement, measured
from compare.sweep.study import Task
from geometry.atomic import write_text

ROWS = Path(__file__).with_name("inputs.csv")

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
        wrong: What was not as promised, by the sentence, with an input that shows it.
    """

    states: Counter[str] = field(default_factory=Counter)
    slowest: float = 0.0
    wrong: dict[str, Task] = field(default_factory=dict)


def fault_of(task: Task) -> tuple[Measurement, str]:
    """Run a task; the sentence says what is wrong with its end, and is empty if nothing is."""
    started = time.perf_counter()
    answer = measured(task)
    seconds = time.perf_counter() - started
    if answer.state == "failed":
        return answer, f"an error of the program: {answer.message}"
    if not answer.message.strip():
        return answer, "no word of explanation"
    if answer.state == "refused" and "Error:" in answer.message:
        return answer, f"a message for programmers: {answer.message}"
    if bad := [name for name, value in answer.values.items() if not math.isfinite(value)]:
        return answer, f"no finite {bad[0]}, though it is {answer.state}"
    if seconds > LONGEST_S:
        return answer, f"it took {seconds:.0f} s"
    return answer, ""


def tried(count: int, solvers: tuple[str, ...] = ("fem",)) -> Outcomes:
    """Try random inputs, without stopping at what is wrong."""
    from hypothesis import HealthCheck, Phase, given, settings

    from benchmarks.reliability.strategies import tasks

    found = Outcomes()

    @settings(
        max_examples=count,
        database=None,
        deadline=None,
        derandomize=True,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(tasks(solvers))
    def one(task: Task) -> None:
        started = time.perf_counter()
        answer, fault = fault_of(task)
        found.states[answer.state] += 1
        found.slowest = max(found.slowest, time.perf_counter() - started)
        if fault:
            found.wrong.setdefault(fault, task)

    one()
    return found


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
    """Try random inputs of a solver and keep the counts."""
    warnings.simplefilter("ignore")
    found = tried(count, (solver,))
    ends = [found.states[state] for state in ("done", "not converged", "refused")]
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    row = Row(solver, sum(found.states.values()), *ends, len(found.wrong), found.slowest, peak)
    for fault, task in found.wrong.items():
        print(fault, task, sep="\n  ", flush=True)
    rows = [row, *(each for each in kept_rows() if each.solver != solver)]
    write_text(ROWS, "".join(",".join(map(str, line)) + "\n" for line in (Row._fields, *rows)))
    print(row)


if __name__ == "__main__":
    main(int(sys.argv[1]), *sys.argv[2:])

"""The search for the best fingers: rounds of an emulator's proposals, each judged by the solver."""

from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from pinnray.geometry.finger.parameters import Parameters
from pinnray.geometry.finger.rules import broken_rule
from pinnray.runtime.atomic import write_json
from pinnray.runtime.errors import UserError
from pinnray.runtime.notebook import brief
from pinnray.runtime.processes.pool import Pool
from pinnray.runtime.stages import Stages
from pinnray.runtime.text_files import read_json
from pinnray.studies.emulator.emulator import fitted_emulator
from pinnray.studies.emulator.inputs import Inputs
from pinnray.studies.optimum.front import reference_point, unbeaten
from pinnray.studies.optimum.question import ENOUGH, Question
from pinnray.studies.sweep.job import StudyJob
from pinnray.studies.sweep.measurement import Measurement
from pinnray.studies.sweep.sampling import samples
from pinnray.studies.sweep.store import Journal, resumed
from pinnray.studies.sweep.study import Value
from pinnray.studies.sweep.sweep import Sweep, finish

QUESTION_FILE, FINGERS_FILE = "question.json", "fingers.json"

BEST = 6
"""Fingers that a search with one objective gives: the next ones may be easier to print."""

ROUNDS = 8
"""Rounds of proposals."""

CANDIDATES = 64
"""Samples that are drawn at most for each that the search starts from, because some break a rule."""


@dataclass(frozen=True, eq=False)
class Optimum(Sweep):
    """All runs of a search as the samples of a sweep, and those on the front.

    Attributes:
        study: The question.
        front: Numbers of the runs on the Pareto front, ordered by the first objective; of one objective those
            of the few best, the best one first.
    """

    study: Question
    front: list[int]

    __repr__ = brief

    def place(self, run: int) -> int:
        """Place of a run on the front, from 1: its number in the table and in the names of the files."""
        return 1 + self.front.index(run)


def search_front(job: StudyJob[Question], stages: Stages | None = None) -> Optimum:
    """Search for the Pareto front with a given number of runs of the solver.

    A third of the runs are samples of a Sobol sequence. Then rounds follow: the emulator is fitted to all
    runs, proposes fingers, and the solver judges them. Every point on the front is a run of the solver. The
    same question and seed give the same runs, on machines that compute alike.

    Raises:
        UserError: If the question cannot be asked, the folder holds another one, or nothing is allowed.
    """
    stages, question = stages or Stages(quiet=True), job.study
    definition = {
        **job.definition(samples(question)[0], __name__),
        "objectives": dict(question.objectives),
        "constraints": {name: limit.model_dump() for name, limit in question.constraints.items()},
        "runs": question.runs,
    }
    with (
        resumed(job.out / QUESTION_FILE, definition, job="search", free={"study.name"}) as (journal, _),
        Pool(job.processes) as pool,
    ):
        journal.forget("failed")
        file, start = job.out / FINGERS_FILE, len(samples(question))
        if not file.exists():
            write_json(file, {"fingers": starting_fingers(job, start)})
        fingers: list[dict[str, Value]] = read_json(file, "search")["fingers"]  # also of an earlier start
        done = 0
        while True:
            with stages.stage(f"runs {done + 1} to {len(fingers)}") as progress:
                tasks = {n: job.task(n, finger) for n, finger in enumerate(fingers)}
                finish(tasks, journal, pool, progress, question.time_limit)
            done = len(fingers)
            if done >= question.runs:
                return _optimum(question, fingers, journal)
            count = min(-(-(question.runs - start) // ROUNDS), question.runs - done)
            with stages.stage(f"proposals after {done}") as progress:
                progress(0.0, "the emulator is fitted and searched")
                fingers = fingers + _proposed(job, fingers, journal, count)
            write_json(file, {"fingers": fingers})


def starting_fingers(job: StudyJob[Question], count: int) -> list[dict[str, Value]]:
    """The first samples of the Sobol sequence that break no rule.

    Raises:
        UserError: If nearly all break one.
    """
    many = job.study.model_copy(update={"samples": CANDIDATES * count})
    found: list[dict[str, Value]] = []
    fault: str | None = None
    for number, finger in enumerate(samples(many)):
        why = broken_rule(Parameters(**job.task(number, finger).definition))
        fault = why or fault
        if why is None:
            found.append(finger)
        if len(found) == count:
            return found
    raise UserError(
        f"only {len(found)} of {CANDIDATES * count} fingers in these ranges can be made ({fault}); change "
        "the ranges"
    )


def _proposed(
    job: StudyJob[Question], fingers: list[dict[str, Value]], journal: Journal, count: int
) -> list[dict[str, Value]]:
    """The next fingers; further samples where the emulator has too few runs or none apart from the others."""
    from pinnray.studies.optimum.proposals import proposals

    question, measured = job.study, journal.measurements()
    more = starting_fingers(job, len(fingers) + count)[len(fingers) :]
    if sum(each.state == "done" for each in measured) < ENOUGH:
        return more
    inputs = Inputs(question, job.task(0, fingers[0]).definition)
    with threadpool_limits(1):  # the same sums, whatever the number of cores
        known = Sweep(question, fingers, measured)
        emulator = fitted_emulator(known, inputs, names=question.names, fewest=ENOUGH, quick=True)
        allowed = [question.costs(each.values) for each in measured if is_allowed(question, each)]
        every = np.array([question.costs(each.values) for each in measured if each.state == "done"])
        found = proposals(
            question,
            emulator,
            np.array(allowed).reshape(-1, len(question.objectives)),
            fingers,
            reference_point(every),
            count=count,
            seed=question.seed + len(fingers),
        )
    return found + more[: count - len(found)]


def is_allowed(question: Question, run: Measurement) -> bool:
    """Whether a run has converged, obeys the constraints and is of a finger that can be so deformed."""
    return run.state == "done" and not run.through_itself and question.allows(run.values)


def _optimum(question: Question, fingers: list[dict[str, Value]], journal: Journal) -> Optimum:
    measured = journal.measurements()
    allowed = [each for each in measured if is_allowed(question, each)]
    if not allowed:
        found = sum(each.state == "done" for each in measured)
        crossed = sum(each.through_itself for each in measured)
        besides = f", {crossed} go through themselves" if crossed else ""
        raise UserError(
            f"none of {len(measured)} runs obeys the constraints ({found} converged{besides}); relax a "
            "constraint, widen the ranges or take a smaller stroke"
        )
    costs = np.array([question.costs(each.values) for each in allowed])
    first = next(iter(question.objectives))
    if question.single:
        on_front = [allowed[place].number for place in np.argsort(costs[:, 0], kind="stable")[:BEST]]
    else:
        on_front = [each.number for each, best in zip(allowed, unbeaten(costs), strict=True) if best]
        on_front.sort(key=lambda number: measured[number].values[first])
    return Optimum(question, fingers, measured, on_front)

"""Run a study: every sample once, whatever happens to the workers or to the program."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from math import inf
from pathlib import Path
from typing import Any

from pinnray.comparison.evaluation.deformed_body import ADVICE
from pinnray.comparison.evaluation.plausibility import LOOKS_LIKE
from pinnray.runtime.errors import UserError
from pinnray.runtime.processes.child import ProcessFailed
from pinnray.runtime.processes.pool import Input, Pool
from pinnray.runtime.stages import Stages
from pinnray.runtime.text_files import read_json
from pinnray.solvers.solver import Progress, silent
from pinnray.studies.sweep.job import StudyJob, Task
from pinnray.studies.sweep.measurement import Measurement, sampled
from pinnray.studies.sweep.sampling import samples
from pinnray.studies.sweep.store import JOURNAL, Journal, opened, resumed
from pinnray.studies.sweep.study import Study, Value

STUDY_FILE = "sweep.json"

FEW = 5
"""Samples that a remark or a row of a table names."""

DEATHS = 8
"""Deaths of its worker after which a sample counts as failed, for any process may be killed by chance."""

OUT_OF_TIME = "stopped at the time limit"

GRACE_S = 10.0
"""Time that a worker has besides the limit of its sample, for what it has to load first, s."""


@dataclass(frozen=True)
class Sweep:
    """The finished samples of a study.

    Attributes:
        study: The study.
        samples: Values of the varied parameters of every sample.
        measurements: Results, ordered by the samples' numbers.
    """

    study: Study
    samples: list[dict[str, Value]]
    measurements: list[Measurement]

    @property
    def good(self) -> list[Measurement]:
        """The converged results."""
        return [each for each in self.measurements if each.state == "done"]

    @property
    def remarks(self) -> list[str]:
        """Remarks on samples that have a result that no real finger has, or look like another unit."""
        found = []
        for fault, advice in (*ADVICE.items(), (LOOKS_LIKE, "check the units of the study")):
            having = [each.number for each in self.measurements if fault in each.message]
            if having:
                which = f"{len(having)} of {len(self.samples)} samples ({first_of(having)})"
                found.append(f"{which}: {fault}; {advice}")
        return found


def first_of(numbers: Sequence[int]) -> str:
    """The first few numbers of samples."""
    return ", ".join(map(str, numbers[:FEW])) + (" ..." if numbers[FEW:] else "")


def run_sweep(job: StudyJob[Study], stages: Stages | None = None) -> Sweep:
    """Run every sample of a study that has no result yet, and keep each result at once.

    Samples that failed by an error of the program are tried again; refused ones are not, because the same
    design is refused again.

    Raises:
        UserError: If the study cannot be run, or the folder holds another one.
    """
    stages = stages or Stages(quiet=True)
    all_samples = samples(job.study)
    tasks = {number: job.task(number, sample) for number, sample in enumerate(all_samples)}
    definition = job.definition(all_samples[0], __name__)
    free = {"study.name", "study.time_limit"}  # on which no result depends
    if job.study.sampling == "sobol":
        free.add("study.samples")  # which may be continued
    if trainings := job.study.settings_alone:
        free.add("study.varied")  # the trainings of another grid go on from their checkpoints
    with resumed(job.out / STUDY_FILE, definition, job="sweep", free=free) as (journal, before):
        other = before.get("study.varied") != definition["study"]["varied"]
        journal.forget("" if trainings and other else "failed")
        if before.get("study.time_limit") != job.study.time_limit:
            journal.forget("not converged", OUT_OF_TIME)
        with stages.stage("samples") as progress, Pool(job.processes) as pool:
            finish(tasks, journal, pool, progress, job.study.time_limit)
        found = [each for each in journal.measurements() if each.number in tasks]
        return Sweep(job.study, all_samples, found)


def finish(
    tasks: Mapping[int, Task],
    journal: Journal,
    pool: Pool,
    progress: Progress = silent,
    time_limit: float | None = None,
) -> None:
    """Run the tasks that have no result in the journal, by the samples' numbers, and keep each at once.

    The first of all runs alone: it compiles the forms of FEniCS, which all would compile at once if its cache
    is empty.
    """
    known = journal.numbers()
    waiting = {number: task for number, task in tasks.items() if number not in known}
    alone = 0 if known else 1
    for part in (dict(islice(waiting.items(), alone)), dict(islice(waiting.items(), alone, None))):
        run_tasks(sampled, part, tasks, journal, pool, progress, time_limit=time_limit, deaths=DEATHS)


def run_tasks(
    work: Callable[[Input, Callable[..., None]], Iterable[Measurement]],
    tasks: Mapping[Any, Input],
    samples: Collection[Any],
    journal: Journal,
    pool: Pool | None,
    progress: Progress = silent,
    *,
    time_limit: float | None = None,
    deaths: int,
) -> None:
    """Run the tasks of a study and keep each result at once.

    Args:
        work: Answers a task with the results of its samples, or reports each of them as it comes.
        tasks: By name; where a process dies, the name is that of the failed sample.
        samples: Numbers or names of all samples of the study.
        journal: Where the results are kept.
        pool: The processes that do the work; None for this one.
        progress: Called with the share that is done and a note.
        time_limit: Of each task, s.
        deaths: Deaths of its process after which a task has failed.
    """
    done = len(journal.numbers() & set(samples))

    def keep(_: Any, found: Measurement) -> None:
        nonlocal done
        journal.add(found)
        done += 1
        progress(done / len(samples), f"{done} of {len(samples)} samples")

    hard = inf if time_limit is None else time_limit + GRACE_S
    if pool is None:
        answers: Iterable[Any] = ((name, work(task, partial(keep, name))) for name, task in tasks.items())
    else:
        answers = pool.answers(work, tasks, report=keep, timeout_s=hard, deaths=deaths)
    for name, answer in answers:
        if not isinstance(answer, ProcessFailed):
            found = list(answer)
        elif answer.exit_code is None:
            found = [
                Measurement(
                    name, "not converged", f"{OUT_OF_TIME}: after {hard:.3g} s, of {time_limit:g} s", hard
                )
            ]
        else:
            times = f"its worker process died {deaths} times" if deaths > 1 else answer.message
            found = [Measurement(name, "failed", times, 0.0)]
        for each in found:
            keep(name, each)


def load_sweep(folder: Path) -> Sweep:
    """The finished samples of a sweep's folder.

    Raises:
        UserError: If the folder holds no sweep, or one without results.
    """
    if not (folder / JOURNAL).is_file():
        raise UserError(f"{folder} holds no sweep; make one by `pinnray sweep STUDY.toml`")
    try:
        study = Study(**read_json(folder / STUDY_FILE, "sweep")["study"])
    except (KeyError, TypeError):
        raise UserError(f"{folder / STUDY_FILE} is no description of a sweep") from None
    every = samples(study)
    with opened(folder / JOURNAL) as journal:
        found = [each for each in journal.measurements() if each.number < len(every)]
    return Sweep(study, every, found)

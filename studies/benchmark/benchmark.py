"""Run solvers on the set of problems; every result is kept at once, and the same call goes on from there."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from pinnray.runtime.content_hash import content_hash, sources_digest
from pinnray.runtime.errors import UserError
from pinnray.runtime.machine import machine, package_versions
from pinnray.runtime.notebook import brief
from pinnray.runtime.processes.pool import Pool, known_to_children
from pinnray.runtime.stages import Stages
from pinnray.solvers.registry import MissingLibraryError, make_solver
from pinnray.solvers.solver import Progress, Solver, check_name
from pinnray.studies.benchmark.entry import Entry, EntryRow, entry_label, load_entries
from pinnray.studies.benchmark.problems import ProblemSet, problem_set
from pinnray.studies.benchmark.scores import BenchmarkTask, score
from pinnray.studies.sweep.measurement import Measurement
from pinnray.studies.sweep.store import Journal, class_of, resumed
from pinnray.studies.sweep.sweep import OUT_OF_TIME, run_tasks

DEFINITION = "definition.json"
ENTRIES = "entries"
FIGURES = ("displacement", "von_mises", "von_mises_away", "force", "energy", "times_fem", "memory")
"""Numbers of a row that have a median."""


@dataclass(frozen=True, eq=False, kw_only=True)
class BenchmarkJob:
    """A benchmark to run.

    Attributes:
        solvers: The solvers to score.
        out: Output folder; what an earlier start finished there is kept.
        which: Name of the set of problems.
        time_limit: Of each problem, s; a solver of the calling script or notebook has none.
        others: Folder with entries to show beside them.
        notes: What an entry says about its settings, by the solver's name.
    """

    solvers: Sequence[Solver]
    out: Path
    which: str = "small"
    time_limit: float = 600.0
    others: Path | None = None
    notes: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Benchmark:
    """Entries on a set of problems.

    Attributes:
        problems: The set.
        entries: Those of this run, then others.
        remarks: What was left out.
    """

    problems: ProblemSet
    entries: Sequence[Entry]
    remarks: Sequence[str] = ()
    __repr__ = brief

    def table(self) -> pd.DataFrame:
        """A row for each entry and problem; see `EntryRow`."""
        rows = [{"entry": each.label, **vars(row)} for each in self.entries for row in each.rows]
        return pd.DataFrame(rows, columns=["entry", *EntryRow.__dataclass_fields__]).drop(columns="claimed")

    def medians(self) -> pd.DataFrame:
        """By entry and law: medians over the problems solved, how many, how many converged, broken claims."""
        table = self.table()
        table["linear"] = table["problem"].map({each.name: each.linear for each in self.problems.problems})
        table["broken"], table["converged"] = table["broken"].map(len), table["state"] == "done"
        solved = table[table["displacement"].notna()].groupby(["entry", "linear"], sort=False)
        counts = solved[["converged", "broken"]].sum()
        return solved[list(FIGURES)].median().assign(solved=solved.size(), **counts)


def run_benchmark(job: BenchmarkJob, stages: Stages | None = None) -> Benchmark:
    """Score every solver on every problem that has no result yet, one at a time.

    Raises:
        UserError: If the benchmark cannot be run, or the folder holds something else.
    """
    stages, problems = stages or Stages(quiet=True), problem_set(job.which)
    labels = [entry_label(solver) for solver in job.solvers]
    for solver in job.solvers:
        check_name(solver.name)
    if not labels or len(set(labels)) < len(labels):
        raise UserError(f"name each solver once, and one at least, not {', '.join(labels) or 'none'}")
    kept = {each.label: each.settings for each in map(Entry.load, (job.out / ENTRIES).glob("*.json"))}
    for solver, label in zip(job.solvers, labels, strict=True):
        if content_hash(kept.get(label, {})) != content_hash(solver.settings() if label in kept else {}):
            raise UserError(f"{job.out} holds an entry of {label} with other settings; name another folder")
    others, remarks = load_entries(job.others, problems) if job.others else ([], [])
    definition = {
        "problems": problems.described,
        "time_limit": job.time_limit,
        "versions": package_versions(),
        "program_sha256": sources_digest(__name__),
    }
    with resumed(job.out / DEFINITION, definition, job="benchmark", free={"time_limit"}) as (journal, before):
        journal.forget("failed")
        if before.get("time_limit") != job.time_limit:
            journal.forget("not converged", OUT_OF_TIME)
        with stages.stage("fem's time") as progress:
            units = _unit_times(problems, journal, progress)
        if not units:
            remarks.append("times are no multiples of fem's, which cannot be loaded")
        entries = []
        for solver, label in zip(job.solvers, labels, strict=True):
            with stages.stage(label) as progress:
                found = _scored(solver, label, problems, journal, progress, job.time_limit)
            rows = [
                _row(problem.name, found[problem.name], units.get(problem.timed().name))
                for problem in problems.problems
            ]
            entry = Entry(
                label=label,
                settings=solver.settings(),
                problems=problems.described,
                time_limit_s=job.time_limit,
                versions=package_versions(),
                machine=machine(),
                rows=rows,
                note=job.notes.get(solver.name, ""),
            )
            entry.save(job.out / ENTRIES)
            entries.append(entry)
    shown = [each for each in others if each.label not in labels]
    return Benchmark(problems, [*entries, *shown], remarks)


def _unit_times(problems: ProblemSet, journal: Journal, progress: Progress) -> dict[str, float]:
    """What `fem` takes for the linear problem of each finger, s, by the problem's name."""
    try:
        fem = make_solver("fem")
    except MissingLibraryError:
        return {}
    tasks = {
        timed.name: BenchmarkTask(timed.name, fem, timed, compared=False)
        for timed in (problem.timed() for problem in problems.problems)
    }
    found = _run(tasks, journal, progress, None)
    return {name: each.values["seconds"] for name, each in found.items() if each.values}


def _scored(
    solver: Solver, label: str, problems: ProblemSet, journal: Journal, progress: Progress, time_limit: float
) -> dict[str, Measurement]:
    """The results of a solver by problem."""
    digest = content_hash([*class_of(solver), solver.settings()])[:16]
    names = {each.name: f"{label}, {each.name}, {digest}" for each in problems.problems}
    tasks = {names[each.name]: BenchmarkTask(names[each.name], solver, each) for each in problems.problems}
    found = _run(tasks, journal, progress, time_limit)
    return {problem: found[name] for problem, name in names.items()}


def _run(
    tasks: Mapping[str, BenchmarkTask], journal: Journal, progress: Progress, time_limit: float | None
) -> dict[str, Measurement]:
    """Run the tasks without a result, in a process of their own if it knows the solver's class."""
    waiting = {name: task for name, task in tasks.items() if name not in journal.numbers()}
    alone = all(known_to_children(task.solver) for task in waiting.values())
    with Pool(1) as pool:
        where = pool if alone else None
        run_tasks(score, waiting, tasks, journal, where, progress, time_limit=time_limit, deaths=1)
    return {each.number: each for each in journal.measurements() if each.number in tasks}


def _row(problem: str, found: Measurement, unit: float | None) -> EntryRow:
    """The row of an entry."""
    state = "out of time" if found.message.startswith(OUT_OF_TIME) else found.state
    seconds = found.values.get("seconds")
    times = seconds / unit if seconds is not None and unit else None
    return EntryRow(problem, state, found.message, times_fem=times, **found.values)

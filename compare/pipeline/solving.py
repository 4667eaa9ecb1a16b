"""The solvers of a comparison: one after another, and on a large mesh in two processes."""

import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import import_module
from pathlib import Path

from threadpoolctl import threadpool_limits

from pinnray.comparison.evaluation.certifier import with_certificates
from pinnray.comparison.evaluation.evaluation import Evaluation, evaluated, solution_key
from pinnray.comparison.pipeline.job import Job
from pinnray.geometry.cache import expected_triangles
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.observations import Observations
from pinnray.runtime.atomic import write_text
from pinnray.runtime.content_hash import sources_digest
from pinnray.runtime.errors import UserError
from pinnray.runtime.machine import cores
from pinnray.runtime.output_folder import SOLUTIONS, TRAINING, take_training
from pinnray.runtime.processes.child import ProcessFailed, end_with_parent
from pinnray.runtime.processes.pool import Pool, known_to_children
from pinnray.runtime.stages import Stages
from pinnray.solvers.problem import Material, Problem
from pinnray.solvers.registry import solver_modules
from pinnray.solvers.shared_work import SharedWork
from pinnray.solvers.solver import (
    NoSolutionError,
    Progress,
    Solver,
    SolverFailedError,
    TrainedSolver,
    TrainingContext,
    Traits,
    UnsoundSolutionError,
    UnsupportedProblemError,
    solved,
    with_law,
)

ERRORS = "errors"
"""Folder of the tracebacks of solvers that raised an exception."""

LARGE = 5000
"""Nodes of a mesh from which a second process gains more than its start takes."""

SHARE = max(1, cores() // 2)
"""Threads of the linear algebra in each of two processes."""

PICTURES = "pinnray.comparison.report.html_report"
"""Module that imports the libraries of pictures, which are drawn next."""

Stage = Callable[[str], AbstractContextManager[Progress]]
"""Begins a stage of a run, as `Stages.stage`."""


@dataclass(frozen=True)
class Outcome:
    """Results and refusals, by the names of the solvers."""

    evaluations: dict[str, Evaluation] = field(default_factory=dict)
    unsupported: dict[str, str] = field(default_factory=dict)  #: Reasons of those that do not support it.
    failed: dict[str, str] = field(default_factory=dict)  #: Reasons of those that have no result.


def second_process(names: Iterable[str] = ()) -> Pool:
    """The pool of a second process, with half of the cores, to start early: it imports what solvers need.

    Args:
        names: Names of the solvers.
    """
    return Pool(1, threads=SHARE, modules=[*solver_modules(names), __name__])


def worth_starting(finger: Finger, mesh: MeshSettings | None) -> bool:
    """Whether a finger's mesh will be so large that a second process can be started before it is made."""
    return expected_triangles(finger, mesh) >= 3 * LARGE  # nearly two for each node, of a rough estimate


def solve_all(
    job: Job,
    solvers: Sequence[Solver],
    problem: Problem,
    observations: Observations,
    folder: Path,
    stages: Stages,
    pool: Pool | None = None,
) -> Outcome:
    """Solve the problem with every solver, or take over the results of an earlier run.

    Solutions and checkpoints go into the folder as they are finished. Only some solvers are given the
    observations. A pool is of a second process.

    Raises:
        UserError: If a solver refuses, the reference fails, or all fail.
    """
    here, there = shares(solvers, job.material, len(problem.mesh.triangles))
    elsewhere = all(map(known_to_children, solvers))
    work, whole = SharedWork(), _Part(job, solvers, problem, observations, folder)
    if pool and elsewhere and here and there and len(problem.mesh.points) >= LARGE:
        outcome = _in_two_processes(whole.of(here), whole.of(there), work, stages, pool)
    else:
        outcome = whole.outcome(stages.stage, work)
    found = outcome.evaluations
    if any(each.law == "linear" for each in found.values()):
        with stages.stage("certificate"), work.used():
            found |= zip(found, with_certificates(list(found.values()), problem), strict=True)
    if outcome.failed and not outcome.evaluations:
        raise UserError(next(iter(outcome.failed.values())))
    names = [solver.name for solver in solvers]
    return Outcome(*({name: each[name] for name in names if name in each} for each in vars(outcome).values()))


def shares(
    solvers: Sequence[Solver], material: Material, triangles: int
) -> tuple[list[Solver], list[Solver]]:
    """The solvers of the process that was asked, and of another one, both in their order, at like cost.

    Solvers of the linear law, but for statistics, share factors and networks, and stay in this process.
    """
    seconds = {each.name: Traits.of(each).cost.seconds(triangles) for each in solvers}
    here = [
        each
        for each in solvers
        if with_law(material, each).law == "linear" and Traits.of(each).family != "statistics"
    ]
    there: list[Solver] = []
    rest = [each for each in solvers if each not in here]
    for solver in sorted(rest, key=lambda each: -seconds[each.name]):
        min(there, here, key=lambda part: sum(seconds[each.name] for each in part)).append(solver)
    return sorted(here, key=solvers.index), sorted(there, key=solvers.index)


def _in_two_processes(own: "_Part", other: "_Part", work: SharedWork, stages: Stages, pool: Pool) -> Outcome:
    """Solve a part in this process, which has imported its libraries, and another one in a second process."""
    with threadpool_limits(SHARE), pool.beside(_answered, other, report=stages.told) as answer:
        outcome = own.outcome(partial(_watching, stages, other, answer), work)
        import_module(PICTURES)  # while the other part goes on: this process draws next
        theirs = other.outcome_in(answer)
    for ours, more in zip(vars(outcome).values(), vars(theirs).values(), strict=True):
        ours.update(more)
    return outcome


@contextmanager
def _watching(
    stages: Stages, other: "_Part", answer: Future[Outcome | UserError | ProcessFailed], name: str
) -> Iterator[Progress]:
    """A stage of this process, which ends with the error of the second process if that has ended by one."""
    with stages.stage(name) as progress:

        def report(fraction: float, note: str) -> None:
            progress(fraction, note)
            if answer.done():
                other.outcome_in(answer)

        yield report


def _answered(part: "_Part", report: Callable[..., None]) -> Outcome | UserError:
    """Solve a part in the second process: its outcome, or the refusal as an error that can be pickled."""
    end_with_parent()

    @contextmanager
    def stage(name: str) -> Iterator[Progress]:
        report(name, 0.0, "")
        try:
            yield partial(report, name)
        finally:
            report(name)

    try:
        return part.outcome(stage, SharedWork())
    except UserError as error:
        return UserError(str(error))


@dataclass(frozen=True)
class _Part:
    """Solvers of a job that run in one process."""

    job: Job
    solvers: Sequence[Solver]
    problem: Problem
    observations: Observations
    folder: Path

    def of(self, solvers: Sequence[Solver]) -> "_Part":
        """A part with some of the solvers, whose process need not import those of the others."""
        return replace(self, job=replace(self.job, solvers=solvers), solvers=solvers)

    def outcome_in(self, answer: Future[Outcome | UserError | ProcessFailed]) -> Outcome:
        """The outcome in the answer of a second process, or the `UserError` that tells why there is none."""
        found = answer.result()
        if isinstance(found, ProcessFailed):
            names = ", ".join(each.name for each in self.solvers)
            found = UserError(f"{names}: {found.message}; a resumed run goes on from what was finished")
        if isinstance(found, UserError):
            raise found
        return found

    def outcome(self, stage: Stage, work: SharedWork) -> Outcome:
        """Solve with one solver after another, in this process."""
        outcome = Outcome()
        for solver in self.solvers:
            trained = self._in_context(solver)
            try:
                with work.used():
                    outcome.evaluations[solver.name] = self._evaluation(trained, stage)
            except UnsupportedProblemError as error:
                if solver.name not in self.job.spare:
                    raise
                outcome.unsupported[solver.name] = str(error)
            except (NoSolutionError, SolverFailedError, UnsoundSolutionError) as error:
                if solver.name == self.job.reference:
                    raise
                outcome.failed[solver.name] = self._reason(solver, error)
        return outcome

    def _reason(self, solver: Solver, error: UserError) -> str:
        """Why a solver has no result; of an exception the traceback is written."""
        if isinstance(error, NoSolutionError):
            return f"{solver.name} found no solution: {error}"
        if error.__cause__ is None:
            return str(error)
        (self.folder / ERRORS).mkdir(exist_ok=True)
        trace = "".join(traceback.format_exception(error.__cause__))
        write_text(self.folder / ERRORS / f"{solver.name}.txt", trace)
        return str(error)

    def _in_context(self, solver: Solver) -> Solver:
        """Give a trained solver the folder of its checkpoints."""
        if not isinstance(solver, TrainedSolver):
            return solver
        job, checkpoints = self.job, self.folder / TRAINING / solver.name
        if job.resume and not checkpoints.exists():
            take_training(solver.name, job.out, self.folder)
        return solver.in_context(TrainingContext(checkpoints, job.resume))

    def _evaluation(self, solver: Solver, stage: Stage) -> Evaluation:
        """Solve and sample, or take over the result of an earlier run."""
        job, traits = self.job, Traits.of(solver)
        given = self.observations if traits.assimilates else None
        own = replace(self.problem, material=with_law(job.material, solver), observations=given)
        key = solution_key(solver, own, self.observations.points, sources_digest(__name__))
        file = Path(SOLUTIONS) / f"{solver.name}.npz"
        with stage(solver.name) as progress:
            for place in (self.folder, job.out) if job.resume else ():
                if (evaluation := Evaluation.load(place / file, key)) is not None:
                    progress(1.0, "taken over from an earlier run")
                    evaluation.save(self.folder / file, key)
                    take_training(solver.name, place, self.folder)
                    return evaluation
            # A solver that hands its work to another one may return the other's name.
            solution = replace(solved(solver, own, progress), solver=solver.name)
            evaluation = evaluated(solution, self.problem.mesh, self.observations.points)
            evaluation = replace(evaluation, family=traits.family, twin=traits.twin)
            evaluation.save(self.folder / file, key)
        return evaluation

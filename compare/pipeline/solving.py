"""The solvers of a comparison: one after another, and those of finite strain beside the linear ones.

The two kinds share no work. On a large mesh they run in two processes, where the job allows that.
"""

import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Protocol

from compare.evaluation.evaluation import Evaluation
from compare.evaluation.metrics import evaluated
from compare.pipeline.job import Job
from compare.runtime.output_folder import SOLUTIONS, TRAINING, take_training
from compare.runtime.processes import ProcessFailed, end_with_parent, in_processes
from compare.runtime.provenance import package_versions
from geometry.atomic import write_text
from geometry.content_hash import content_hash, sources_digest
from geometry.errors import UserError
from geometry.observations import Observations
from solvers.problem import Problem
from solvers.shared_work import SharedWork
from solvers.solver import (
    Progress,
    Solver,
    SolverFailedError,
    TrainedSolver,
    TrainingContext,
    Traits,
    UnsupportedProblemError,
    silent,
    solved,
    with_law,
)

ERRORS = "errors"
"""Folder of the tracebacks of solvers that raised an exception."""

LARGE = 5000
"""Nodes of a mesh from which a second process gains more than its start, 3 s, takes."""


class Staged(Protocol):
    """What shows the stages of a run."""

    def stage(self, name: str) -> AbstractContextManager[Progress]:
        """Run a stage, as `compare.runtime.stages.Stages.stage`."""
        ...


@dataclass(frozen=True)
class Outcome:
    """What the solvers came to.

    Attributes:
        evaluations: By the names of the solvers.
        unsupported: Reasons why solvers do not support the problem, by their names.
        failed: Exceptions of solvers, by their names.
    """

    evaluations: dict[str, Evaluation] = field(default_factory=dict)
    unsupported: dict[str, str] = field(default_factory=dict)
    failed: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class _Part:
    """Solvers of a job that run in one process."""

    job: Job
    solvers: Sequence[Solver]
    problem: Problem
    observations: Observations
    folder: Path


def solve_all(
    job: Job,
    solvers: Sequence[Solver],
    problem: Problem,
    observations: Observations,
    folder: Path,
    stages: Staged,
) -> Outcome:
    """Solve the problem with every solver, or take over what an earlier run finished.

    Args:
        job: What is compared.
        solvers: Those of the job that support the problem, in their order.
        problem: Without the marker displacements, which only some solvers are given.
        observations: The marker displacements.
        folder: For solutions and checkpoints as they are finished.
        stages: Told of the progress.

    Raises:
        UserError: If a solver refuses, the reference fails, or all fail.
    """
    linear = [each for each in solvers if with_law(job.material, each).law == "linear"]
    others = [each for each in solvers if each not in linear]
    if job.processes > 1 and linear and others and len(problem.mesh.points) >= LARGE:
        parts = {
            name: _Part(job, own, problem, observations, folder)
            for name, own in (("linear solvers", linear), ("solvers of finite strain", others))
        }
        outcome = _in_two_processes(parts, stages)
    else:
        outcome = _one_after_another(_Part(job, solvers, problem, observations, folder), stages)
    if outcome.failed and not outcome.evaluations:
        raise UserError(next(iter(outcome.failed.values())))
    order = {solver.name: number for number, solver in enumerate(solvers)}
    return Outcome(
        *(dict(sorted(each.items(), key=lambda item: order[item[0]])) for each in vars(outcome).values())
    )


def _one_after_another(part: _Part, stages: Staged) -> Outcome:
    """Solve in this process."""
    outcome = Outcome()
    job, folder = part.job, part.folder
    work = SharedWork()
    for solver in part.solvers:
        trained = _in_context(solver, part, outcome.evaluations)
        try:
            with work.used():
                outcome.evaluations[solver.name] = _evaluate(part, trained, stages)
        except UnsupportedProblemError as error:
            if solver.name not in job.spare:
                raise
            outcome.unsupported[solver.name] = str(error)
        except SolverFailedError as error:
            if solver.name == job.reference:
                raise
            (folder / ERRORS).mkdir(exist_ok=True)
            trace = "".join(traceback.format_exception(error.__cause__))
            write_text(folder / ERRORS / f"{solver.name}.txt", trace)
            outcome.failed[solver.name] = str(error)
    return outcome


def _in_two_processes(parts: dict[str, _Part], stages: Staged) -> Outcome:
    """Solve every part in a process of its own."""
    outcome = Outcome()
    shown = {name: _Shown(stages) for name in parts}
    with closing(
        in_processes(
            _answered,
            parts,
            processes=len(parts),
            report=lambda name, *told: shown[name].report(*told),
        )
    ) as answers:
        for name, answer in answers:
            if isinstance(answer, ProcessFailed):
                raise UserError(f"{name}: {answer.message}; a resumed run goes on from what was finished")
            if isinstance(answer, UserError):
                raise answer
            shown[name].end()
            for ours, theirs in zip(vars(outcome).values(), vars(answer).values(), strict=True):
                ours.update(theirs)
    return outcome


def _answered(part: _Part, report: Callable[..., None]) -> Outcome | UserError:
    """The work of a process: its outcome, or the refusal as an error that another process can raise."""
    end_with_parent()
    try:
        return _one_after_another(part, _Told(report))
    except UserError as error:
        return UserError(str(error))


@dataclass(frozen=True)
class _Told:
    """The stages of a process, which its parent shows."""

    report: Callable[..., None]

    @contextmanager
    def stage(self, name: str) -> Iterator[Progress]:
        """Report the stage's name with its progress."""
        self.report(name, 0.0, "")
        yield partial(self.report, name)


class _Shown:
    """The stages of another process, one after another."""

    def __init__(self, stages: Staged) -> None:
        self._stages = stages
        self._open = ExitStack()
        self._name = ""
        self._progress: Progress = silent

    def report(self, name: str, fraction: float, note: str) -> None:
        """Show the progress of a stage; a new name ends the one before."""
        if name != self._name:
            self.end()
            self._name, self._progress = name, self._open.enter_context(self._stages.stage(name))
        self._progress(fraction, note)

    def end(self) -> None:
        """End the last stage."""
        self._open.close()


def _in_context(solver: Solver, part: _Part, finished: Mapping[str, Evaluation]) -> Solver:
    """The solver, told where to save its training and the energy of `fem`, if it takes that."""
    if not isinstance(solver, TrainedSolver):
        return solver
    job, folder = part.job, part.folder
    checkpoints = folder / TRAINING / solver.name
    if job.resume and not checkpoints.exists():
        take_training(solver.name, job.out, folder)
    law = with_law(job.material, solver).law
    fem = finished.get("fem")
    energy = fem.energy if fem and fem.law == law else None
    return solver.in_context(TrainingContext(checkpoints, job.resume, energy))


def _evaluate(part: _Part, solver: Solver, stages: Staged) -> Evaluation:
    """Solve and sample, or take over what an earlier run finished."""
    job, folder, problem, observations = part.job, part.folder, part.problem, part.observations
    traits = Traits.of(solver)
    given = observations if traits.assimilates else None
    own = replace(problem, material=with_law(job.material, solver), observations=given)
    key = _key(solver, own, observations)
    kept = folder / SOLUTIONS / f"{solver.name}.npz"
    with stages.stage(solver.name) as progress:
        if job.resume:
            for place in (folder, job.out):
                if (evaluation := Evaluation.load(place / SOLUTIONS / kept.name, key)) is not None:
                    progress(1.0, "taken over from an earlier run")
                    evaluation.save(kept, key)
                    take_training(solver.name, place, folder)
                    return evaluation
        solution = solved(solver, own, progress)
        # A solver that hands its work to another one may return the other's name.
        solution = replace(solution, solver=solver.name)
        evaluation = evaluated(solution, problem.mesh, observations.points)
        evaluation = replace(evaluation, family=traits.family, twin=traits.twin)
        evaluation.save(kept, key)
    return evaluation


def _key(solver: Solver, problem: Problem, observations: Observations) -> str:
    """SHA-256 over everything that a solution's samples depend on, the solver's own sources included."""
    parts = [
        solver.name,
        solver.settings(),
        package_versions(),
        sources_digest(__name__, type(solver).__module__),
        problem.digest,
        observations.points,
    ]
    return content_hash(parts)

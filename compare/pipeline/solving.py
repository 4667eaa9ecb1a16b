"""The solvers of a comparison: one after another, and on a large mesh in two processes.

Networks and finite elements of the linear law, which share work, are solved in the process that was asked;
the others where less is to be done.
"""

import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import import_module
from pathlib import Path

from threadpoolctl import threadpool_limits

from compare.evaluation.certification import with_certificates
from compare.evaluation.evaluation import Evaluation
from compare.evaluation.metrics import evaluated
from compare.pipeline.job import Job
from compare.runtime.output_folder import SOLUTIONS, TRAINING, take_training
from compare.runtime.provenance import cores, package_versions
from compare.runtime.stages import Stages
from geometry.atomic import write_text
from geometry.cache import expected_triangles
from geometry.content_hash import content_hash, sources_digest
from geometry.errors import UserError
from geometry.finger.finger import Finger
from geometry.mesh.settings import MeshSettings
from geometry.observations import Observations
from geometry.processes import Pool, ProcessFailed, end_with_parent
from solvers.problem import Material, Problem
from solvers.shared_work import SharedWork
from solvers.solver import (
    NoSolutionError,
    Progress,
    Solver,
    SolverFailedError,
    TrainedSolver,
    TrainingContext,
    Traits,
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

SECONDS = {
    "pinn-id": 17.0,
    "pinn-std": 6.0,
    "fem-id": 5.0,
    "fem-nonlinear": 2.5,
    "pinn-asm": 1.7,
    "statfem": 1.2,
    "gp": 0.7,
}
"""On the default finger, beside another process; of any other solver one."""

THERE = ("solvers.pinn.identification.solver", "solvers.statistics.statistical_fem", __name__)
"""Modules of what the second process solves, which it imports as it starts."""

PICTURES = "compare.report.html_report"
"""Module that imports the libraries of pictures, which both processes draw next."""

Stage = Callable[[str], AbstractContextManager[Progress]]
"""Begins a stage of a run, as `Stages.stage`."""


@dataclass(frozen=True)
class Outcome:
    """Results and refusals, by the names of the solvers."""

    evaluations: dict[str, Evaluation] = field(default_factory=dict)
    unsupported: dict[str, str] = field(default_factory=dict)  #: Reasons of those that do not support it.
    failed: dict[str, str] = field(default_factory=dict)  #: Reasons of those that have no result.


def second_process() -> Pool:
    """The pool of a second process, with half of the cores; started early, it is ready when it is needed."""
    return Pool(1, threads=SHARE, modules=THERE)


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
    here, there = shares(solvers, job.material)
    # A class of the calling script is unknown to other processes.
    elsewhere = all(type(each).__module__ != "__main__" for each in solvers)
    work = SharedWork()
    if pool and elsewhere and here and there and len(problem.mesh.points) >= LARGE:
        # Without the solvers of the other part, which would be imported there.
        own, other = (
            _Part(replace(job, solvers=part), part, problem, observations, folder) for part in (here, there)
        )
        outcome = _beside_each_other(own, other, work, stages, pool)
    else:
        outcome = _Part(job, solvers, problem, observations, folder).outcome(stages.stage, work)
    found = outcome.evaluations
    if any(each.law == "linear" for each in found.values()):
        with stages.stage("certificate"), work.used():
            found |= zip(found, with_certificates(list(found.values()), problem), strict=True)
    if outcome.failed and not outcome.evaluations:
        raise UserError(next(iter(outcome.failed.values())))
    names = [solver.name for solver in solvers]
    return Outcome(*({name: each[name] for name in names if name in each} for each in vars(outcome).values()))


def shares(solvers: Sequence[Solver], material: Material) -> tuple[list[Solver], list[Solver]]:
    """The solvers of the process that was asked, and of another one, both in their order."""
    here = [each for each in solvers if _shares_work(each, material)]
    there: list[Solver] = []
    rest = [each for each in solvers if each not in here]
    for solver in sorted(rest, key=_seconds, reverse=True):
        parts = sorted((there, here), key=lambda part: sum(map(_seconds, part)))
        parts[0].append(solver)
    return sorted(here, key=solvers.index), sorted(there, key=solvers.index)


def _shares_work(solver: Solver, material: Material) -> bool:
    """Whether a solver is of the linear law, and no statistics: these share factors and networks."""
    return with_law(material, solver).law == "linear" and Traits.of(solver).family != "statistics"


def _seconds(solver: Solver) -> float:
    return SECONDS.get(solver.name, 1.0)


def _beside_each_other(own: "_Part", other: "_Part", work: SharedWork, stages: Stages, pool: Pool) -> Outcome:
    """Solve a part in this process, which has imported its libraries, and another one in a second process."""
    shown, last = dict[str, Progress](), ExitStack()

    def told(stage: str, fraction: float, note: str) -> None:
        if stage not in shown:
            last.close()
            shown[stage] = last.enter_context(stages.stage(stage))
        shown[stage](fraction, note)

    def theirs() -> Outcome:
        found = answer.result()
        if isinstance(found, ProcessFailed):
            raise UserError(
                f"{', '.join(each.name for each in other.solvers)}: {found.message}; "
                "a resumed run goes on from what was finished"
            )
        if isinstance(found, UserError):
            raise found
        return found

    @contextmanager
    def stage(name: str) -> Iterator[Progress]:
        with stages.stage(name) as progress:

            def checked(fraction: float, note: str) -> None:
                progress(fraction, note)
                if answer.done():
                    theirs()

            yield checked

    with threadpool_limits(SHARE), pool.beside(_answered, other, report=told) as answer:
        answer.add_done_callback(lambda _: last.close())
        outcome = own.outcome(stage, work)
        import_module(PICTURES)  # while the other part goes on: this process draws next
        for ours, more in zip(vars(outcome).values(), vars(theirs()).values(), strict=True):
            ours.update(more)
    return outcome


def _answered(part: "_Part", report: Callable[..., None]) -> Outcome | UserError:
    """The work of a process: its outcome, or the refusal as an error that another process can raise."""
    end_with_parent()

    def stage(name: str) -> AbstractContextManager[Progress]:
        report(name, 0.0, "")
        return nullcontext(partial(report, name))

    try:
        outcome = part.outcome(stage, SharedWork())
    except UserError as error:
        return UserError(str(error))
    import_module(PICTURES)
    return outcome


@dataclass(frozen=True)
class _Part:
    """Solvers of a job that run in one process."""

    job: Job
    solvers: Sequence[Solver]
    problem: Problem
    observations: Observations
    folder: Path

    def outcome(self, stage: Stage, work: SharedWork) -> Outcome:
        """Solve with one solver after another, in this process."""
        outcome = Outcome()
        for solver in self.solvers:
            trained = self._in_context(solver, outcome.evaluations.get("fem"))
            try:
                with work.used():
                    outcome.evaluations[solver.name] = self._evaluation(trained, stage)
            except UnsupportedProblemError as error:
                if solver.name not in self.job.spare:
                    raise
                outcome.unsupported[solver.name] = str(error)
            except (NoSolutionError, SolverFailedError) as error:
                if solver.name == self.job.reference:
                    raise
                outcome.failed[solver.name] = self._reason(solver, error)
        return outcome

    def _reason(self, solver: Solver, error: UserError) -> str:
        """Why a solver has no result; of an exception the traceback is written."""
        if isinstance(error, NoSolutionError):
            return f"{solver.name} found no solution: {error}"
        (self.folder / ERRORS).mkdir(exist_ok=True)
        trace = "".join(traceback.format_exception(error.__cause__))
        write_text(self.folder / ERRORS / f"{solver.name}.txt", trace)
        return str(error)

    def _in_context(self, solver: Solver, fem: Evaluation | None) -> Solver:
        """Give a trained solver the folder of its checkpoints and the energy of `fem` under its law."""
        if not isinstance(solver, TrainedSolver):
            return solver
        job, checkpoints = self.job, self.folder / TRAINING / solver.name
        if job.resume and not checkpoints.exists():
            take_training(solver.name, job.out, self.folder)
        law = with_law(job.material, solver).law
        energy = fem.energy if fem and fem.law == law else None
        return solver.in_context(TrainingContext(checkpoints, job.resume, energy))

    def _evaluation(self, solver: Solver, stage: Stage) -> Evaluation:
        """Solve and sample, or take over the result of an earlier run."""
        job, traits = self.job, Traits.of(solver)
        given = self.observations if traits.assimilates else None
        own = replace(self.problem, material=with_law(job.material, solver), observations=given)
        depends_on = [
            solver.name,
            solver.settings(),
            package_versions(),
            sources_digest(__name__, type(solver).__module__),
            own.digest,
            self.observations.points,
        ]
        key, file = content_hash(depends_on), Path(SOLUTIONS) / f"{solver.name}.npz"
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

"""All folds of one solver: what it says of what it was not given."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from compare.crossval.folds import Fold, LoadCase, hide_markers
from compare.crossval.true_fields import FieldSampler, SampledField, TrueFields
from geometry.arrays import FloatArray
from geometry.atomic import write_json
from geometry.errors import UserError
from geometry.mesh.triangle_mesh import TriangleMesh
from geometry.observations import Observations
from solvers.assimilation.misfit import assimilates
from solvers.assimilation.refitting import Carrying, refitter
from solvers.problem import Material, Problem
from solvers.registry import make_solver
from solvers.solution import Solution
from solvers.solver import Progress, Solver, UnsupportedProblemError, silent, with_law


@dataclass(frozen=True)
class SolverVariant:
    """A solver with settings, under the name that tables call it by.

    Attributes:
        label: The solver's name, and how it differs from others of that name.
        solver: Its name.
        settings: Its settings.
    """

    label: str
    solver: str
    settings: Mapping[str, object]

    @property
    def file_name(self) -> str:
        """Of the folder for what it has finished."""
        return self.label.replace(" ", "_")

    def make(self, seed: int) -> Solver:
        """The solver; what random numbers it draws differ from seed to seed."""
        settings = dict(self.settings)
        if isinstance(first := settings.get("seed"), int):
            settings["seed"] = first + seed
        return make_solver(self.solver, **settings)


@dataclass(frozen=True)
class FoldResult:
    """A solver in one fold for one seed.

    Attributes:
        fold: What was held out.
        errors: Predicted minus observed displacement of every marker at the fold's load, shape (m, 2), mm.
        deviations: Standard deviations of these that the solver states, of shape (m, 2), mm; None if none.
        fields: Relative L2 distances from the truth; empty without a truth.
        converged: Whether the solver did, by its own criterion.
        given: Whether it was given any markers.
    """

    fold: Fold
    errors: Sequence[Sequence[float]]
    deviations: Sequence[Sequence[float]] | None = None
    fields: Mapping[str, float] = field(default_factory=dict)
    converged: bool = True
    given: bool = True

    @property
    def held(self) -> list[int]:
        """Numbers of the markers whose errors count as held out."""
        every = range(len(self.errors))
        return list(every) if self.fold.unseen is None else list(self.fold.unseen)

    @property
    def held_out(self) -> FloatArray:
        """Errors at markers that were not given at this load, shape (h, 2), mm."""
        return np.asarray(np.array(self.errors)[self.held])

    @property
    def in_sample(self) -> FloatArray:
        """Errors at markers that were given at this load, shape (g, 2), mm."""
        given = np.full(len(self.errors), self.given)
        given[self.held] = False
        return np.asarray(np.array(self.errors)[given])

    @property
    def ratios(self) -> FloatArray:
        """Errors of held-out markers over their stated standard deviations, shape (h, 2), or (0, 2)."""
        if self.deviations is None:
            return np.zeros((0, 2))
        return np.asarray(self.held_out / np.array(self.deviations)[self.held])

    @classmethod
    def read(cls, content: Mapping[str, Any]) -> "FoldResult":
        """From what `asdict` makes of it."""
        fold = Fold(**{**content["fold"], "held": tuple(content["fold"]["held"])})
        fields = {name: float("nan") if value is None else value for name, value in content["fields"].items()}
        return cls(**{**content, "fold": fold, "fields": fields})


@dataclass(frozen=True, eq=False)
class SolverTask:
    """All that a process needs for one solver.

    Attributes:
        entry: The solver.
        mesh: File of the shared mesh.
        material: Elastic constants.
        conditions: The loads, the full one first.
        truths: File of the true fields at each load; none with real measurements.
        observations: For each seed, those at every load.
        folds: What to hold out.
        folder: Where finished folds are kept.
        threads: Of the processor.
    """

    entry: SolverVariant
    mesh: Path
    material: Material
    conditions: Sequence[LoadCase]
    truths: Sequence[Path]
    observations: Sequence[Sequence[Observations]]
    folds: Sequence[Fold]
    folder: Path
    threads: int


@dataclass(frozen=True)
class FailedSolver:
    """A solver that ended without a result.

    Attributes:
        message: Why.
    """

    message: str


def run_folds(task: SolverTask, progress: Progress = silent) -> list[list[FoldResult]] | FailedSolver:
    """Run a solver through all folds for every seed, going on from what is kept.

    Returns:
        For every seed the folds' outcomes, in the order of the task's folds.
    """
    try:
        judged = _FoldRunner(task)
        outcomes = []
        for seed in range(len(task.observations)):
            done = seed / len(task.observations)

            def report(share: float, text: str, done: float = done) -> None:
                progress(done + share / len(task.observations), text)

            outcomes.append(judged.seed(seed, report))
    except UserError as error:
        return FailedSolver(str(error))
    return outcomes


class _FoldRunner:
    """One solver on one mesh."""

    def __init__(self, task: SolverTask) -> None:
        self._task = task
        mesh = TriangleMesh.load(task.mesh)
        solver = task.entry.make(0)
        self._problem = Problem(mesh, with_law(task.material, solver), task.conditions[0].load)
        finite = task.material.model_copy(update={"law": "neo-hookean", "plane": "strain"})
        self._finite = replace(self._problem, material=finite)
        markers = task.observations[0][0]
        self._sampler = FieldSampler.of(mesh, markers.points, markers.marker_radius)
        self._truths = [TrueFields.load(path) for path in task.truths]
        self._priors: dict[int, SampledField | None] = {}
        self._plain: dict[int, tuple[SampledField, bool]] = {}
        self._refit: Callable[[Observations], Solution] | None = None

    def seed(self, seed: int, progress: Progress) -> list[FoldResult]:
        """The outcomes of all folds for a seed."""
        path = self._task.folder / f"seed-{seed}.json"
        settings = json.loads(json.dumps(dict(self._task.entry.make(seed).settings())))
        kept = _kept(path, settings)
        outcomes: list[FoldResult] = []
        fitted: tuple[Fold, Solution] | None = None
        solver = self._task.entry.make(seed)
        if "seed" in solver.settings():
            self._refit, self._plain, self._priors = None, {}, {}
        for number, fold in enumerate(self._task.folds):
            progress(number / len(self._task.folds), f"{fold.scheme}: {fold.name}")
            if (outcome := kept.get((fold.scheme, fold.name))) is not None and outcome.fold == fold:
                outcomes.append(outcome)
                continue
            if assimilates(solver):
                if fitted is None or fitted[0].held != fold.held:
                    fitted = fold, self._fit(solver, seed, fold)
                outcome = self._assimilated(solver, seed, fold, fitted[1])
            else:
                outcome = self._not_given(solver, seed, fold)
            outcomes.append(outcome)
            kept[fold.scheme, fold.name] = outcome
            write_json(path, {"settings": settings, "outcomes": [asdict(entry) for entry in kept.values()]})
        return outcomes

    def _fit(self, solver: Solver, seed: int, fold: Fold) -> Solution:
        self._refit = self._refit or refitter(solver, self._problem)
        return self._refit(hide_markers(self._task.observations[seed][0], fold.held))

    def _at(self, condition: int) -> Problem:
        return replace(self._problem, load=self._task.conditions[condition].load)

    def _not_given(self, solver: Solver, seed: int, fold: Fold) -> FoldResult:
        """A solver that is given no markers: one solution for each load serves all."""
        if fold.condition not in self._plain:
            solution = solver.solve(self._at(fold.condition))
            sampled = self._sampler.of_solution(solution, self._problem.mesh)
            self._plain[fold.condition] = sampled, bool(solution.status.converged)
        sampled, converged = self._plain[fold.condition]
        return self._outcome(seed, fold, sampled, None, converged, given=False)

    def _assimilated(self, solver: Solver, seed: int, fold: Fold, solution: Solution) -> FoldResult:
        mesh, deviations = self._problem.mesh, None
        if fold.condition == 0:
            sampled = self._sampler.of_solution(solution, mesh)
            stated = getattr(solution.field, "standard_deviation", None)
            if stated is not None:
                noise = self._task.observations[seed][0].standard_deviations
                deviations = np.hypot(stated(self._sampler.centres), noise)
        elif isinstance(solver, Carrying):
            other = solver.carried(solution, self._problem, self._at(fold.condition))
            sampled = self._sampler.of_solution(other, mesh)
        else:
            sampled = self._corrected(solver, solution, fold.condition)
        return self._outcome(seed, fold, sampled, deviations, bool(solution.status.converged), given=True)

    def _corrected(self, solver: Solver, solution: Solution, condition: int) -> SampledField:
        """The solver without markers at another load, plus its correction at the first one times the stroke.

        The correction is what the markers change. Without a solution of its own, it is all of it.
        """
        sampled = self._sampler.of_solution(solution, self._problem.mesh)
        there, here = (self._prior(solver, place) for place in (condition, 0))
        share = self._task.conditions[condition].share
        if there is None or here is None:
            zero = sampled.plus(sampled, -1.0)
            return zero.plus(sampled, share)
        return there.plus(sampled.plus(here, -1.0), share)

    def _prior(self, solver: Solver, condition: int) -> SampledField | None:
        """What a solver says without markers; None if it says nothing."""
        if condition not in self._priors:
            try:
                solution = solver.solve(self._at(condition))
                self._priors[condition] = self._sampler.of_solution(solution, self._problem.mesh)
            except UnsupportedProblemError:
                self._priors[condition] = None
        return self._priors[condition]

    def _outcome(
        self,
        seed: int,
        fold: Fold,
        sampled: SampledField,
        deviations: FloatArray | None,
        converged: bool,
        *,
        given: bool,
    ) -> FoldResult:
        fields = {}
        if self._truths:
            truth = self._truths[fold.condition]
            fields = truth.distance(sampled, self._problem, self._finite, self._sampler.weights)
        observed = self._task.observations[seed][fold.condition].displacements
        return FoldResult(
            fold=fold,
            errors=(sampled.markers - observed).tolist(),
            deviations=None if deviations is None else deviations.tolist(),
            fields=fields,
            converged=converged,
            given=given,
        )


def _kept(path: Path, settings: Mapping[str, object]) -> dict[tuple[str, str], FoldResult]:
    """FoldResults of an earlier run with the same settings, by scheme and fold."""
    if not path.exists():
        return {}
    content = json.loads(path.read_text(encoding="utf-8"))
    if content["settings"] != settings:
        return {}
    outcomes = [FoldResult.read(entry) for entry in content["outcomes"]]
    return {(outcome.fold.scheme, outcome.fold.name): outcome for outcome in outcomes}

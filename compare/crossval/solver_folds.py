"""One solver in all folds, in a process of its own; finished folds are kept."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ConfigDict, TypeAdapter
from pydantic_core import to_jsonable_python
from scipy.special import ndtri

from pinnray.comparison.crossval.folds import ALL, Fold, FoldResult, LoadCase, hide_markers
from pinnray.comparison.crossval.scores import FIELDS, LEVEL
from pinnray.comparison.crossval.study import CrossvalStudy, SolverVariant
from pinnray.comparison.crossval.true_fields import FieldSampler, SampledField, TrueField
from pinnray.comparison.evaluation.deformed_body import DeformedBody
from pinnray.comparison.evaluation.truths import SLIDING, Truth
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.runtime.atomic import write_bytes
from pinnray.runtime.content_hash import has_source, sources_digest
from pinnray.runtime.errors import UserError
from pinnray.runtime.processes.pool import known_to_children
from pinnray.solvers.assimilation.marker_forces import root_mean_square
from pinnray.solvers.assimilation.marker_weighting import FACTORS
from pinnray.solvers.fem.assimilating import FemAsmSolver
from pinnray.solvers.lagrange import LagrangeField, LagrangeSpace
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import (
    Progress,
    Solver,
    Traits,
    Transferable,
    UnsupportedProblemError,
    refitter,
    silent,
    solved,
    with_law,
)


@dataclass(frozen=True, eq=False)
class SolverTask:
    """All that a process needs to run one solver.

    Attributes:
        study: Finger, mesh and material.
        layout: Name of the markers' layout.
        variant: The solver.
        load_cases: The loads, the full one first.
        truths: File of the true fields at each load; empty with measurements.
        observations: For each seed, the markers at every load.
        folds: The markers and loads to hold out.
        truth: The truth that the files hold; None with measurements.
    """

    study: CrossvalStudy
    layout: str
    variant: SolverVariant
    load_cases: Sequence[LoadCase]
    truths: Sequence[Path]
    observations: Sequence[Sequence[Observations]]
    folds: Sequence[Fold]
    truth: Truth | None = SLIDING

    @property
    def folder(self) -> Path:
        """Folder of finished folds."""
        parts = [] if self.truth is None else [self.truth.name]
        return self.study.out.joinpath("runs", *parts, self.layout, self.variant.label.replace(" ", "_"))

    @property
    def for_pool(self) -> bool:
        """Whether a process of a pool can run it: none knows a solver's class of the calling script."""
        return known_to_children(self.variant.solver)


@dataclass(frozen=True)
class _KeptFolds:
    """The content of a file of finished folds."""

    settings: dict[str, Any]
    results: list[FoldResult]
    __pydantic_config__ = ConfigDict(ser_json_inf_nan="constants")


_FILE = TypeAdapter(_KeptFolds)

SWEPT = "fem-asm"
"""The solver whose minimisers for all weights come from one factorisation."""


def run_folds(task: SolverTask, progress: Progress = silent) -> list[list[FoldResult]] | str:
    """Run a solver through all folds for every seed, skipping finished folds.

    Returns:
        For every seed the results in the order of the task's folds; the error message if the solver fails.
    """
    seeds = len(task.observations)
    results: list[list[FoldResult]] = []
    runner = None
    try:
        for seed in range(seeds):
            solver = task.variant.make(seed)
            if runner is None or "seed" in solver.settings():
                runner = FoldRunner(task, solver)
            results.append(
                runner.run(seed, lambda share, text: progress((len(results) + share) / seeds, text))
            )
    except UserError as error:
        return str(error)
    return results


class FoldRunner:
    """One solver on one mesh, with the work that folds share.

    Attributes:
        problem: The problem without markers, at the full load, with the solver's law.
        sampler: The points at which fields are sampled.
    """

    def __init__(self, task: SolverTask, solver: Solver) -> None:
        self._task, self._solver = task, solver
        mesh, material = TriangleMesh.load(task.study.mesh_file), task.study.material
        load = task.load_cases[0].load
        self.problem = Problem(mesh, with_law(material, solver), load, finger=task.study.design)
        self._true_law = replace(self.problem, material=(task.truth or SLIDING).material(material))
        markers = task.observations[0][0]
        self.sampler = FieldSampler.of(mesh, markers.points, markers.marker_radius)
        self._body = DeformedBody(mesh)
        self._truths = [TrueField.load(path) for path in task.truths]
        self._unassimilated: dict[int, tuple[Solution, SampledField]] = {}
        self._refit: Callable[[Observations], Solution] | None = None
        self._fit: tuple[tuple[int, ...], Solution] | None = None

    def run(self, seed: int, progress: Progress) -> list[FoldResult]:
        """The results of all folds for a seed."""
        path = self._task.folder / f"seed-{seed}.json"
        settings, kind = to_jsonable_python(self._solver.settings()), type(self._solver)
        settings["program_sha256"] = sources_digest(kind.__module__)
        settings["class"] = f"{kind.__module__}.{kind.__qualname__}"
        results = _kept(path, settings) if has_source(kind.__module__) else {}
        self._fit = None
        for number, fold in enumerate(self._task.folds):
            progress(number / len(self._task.folds), f"{fold.scheme}: {fold.name}")
            if fold not in results:
                results[fold] = self._result(self._task.observations[seed], fold)
                write_bytes(path, _FILE.dump_json(_KeptFolds(settings, list(results.values()))))
        return [results[fold] for fold in self._task.folds]

    def _result(self, observations: Sequence[Observations], fold: Fold) -> FoldResult:
        """One fold, of which `observations` holds the markers at every load."""
        given, deviations = Traits.of(self._solver).assimilates, None
        if not given:
            solution, sampled = self._without_markers(fold.load_case)
        else:
            solution = self._fitted(observations[0], fold.held)
            sampled = self._at_load_case(solution, fold.load_case)
            if solution.uncertainty and fold.load_case == 0:
                deviation = solution.uncertainty.shown or solution.uncertainty.displacement
                noise = observations[0].standard_deviations
                deviations = np.hypot(deviation(self.sampler.centres), noise).tolist()
        own = replace(self.problem, material=solution.problem.material)  # a solver may have estimated it
        status, faults = self._body.status(solution)
        against = [*faults, *([] if status.converged else [f"did not converge: {solution.status.message}"])]
        shown = sampled.markers
        if fold.load_case == 0:  # the picture at another load has another frame
            shown = solution.shown(observations[0].points, shown)
        errors = shown - observations[fold.load_case].displacements
        if not np.isfinite(errors).all():
            raise UserError(f"{self._solver.name}: its displacement is not finite at every marker")
        return FoldResult(
            fold,
            errors=errors.tolist(),
            deviations=deviations,
            fields=self.distances(sampled, fold.load_case, own),
            converged=status.converged,
            given=given,
            message="; ".join(against),
            **(self._against_truth(solution, sampled) if fold.scheme == ALL and self._truths else {}),
        )

    def distances(self, sampled: SampledField, case: int, own: Problem | None = None) -> dict[str, float]:
        """Relative L2 distances of a field from the truth at a load case; none without a truth.

        `own` is the problem with the material that the solver found, if it found one.
        """
        if not self._truths:
            return {}
        true, weights = self._truths[case].sampled, self.sampler.weights
        return sampled.distances(true, own or self.problem, self._true_law, weights)

    def _against_truth(self, solution: Solution, sampled: SampledField) -> dict[str, Any]:
        """Force, place of the contact and stated intervals against the truth at the full load."""
        truth, identified = self._truths[0], solution.identified
        contact = truth.contact
        found: dict[str, Any] = {}
        if np.isfinite(solution.reaction).all():
            found["force"] = float(np.linalg.norm(solution.reaction)) / contact.force - 1
        if identified:
            found["force_within"] = identified.size.low <= contact.force <= identified.size.high
            if place := identified.position:
                found["position"] = place.value - contact.position
                found["position_within"] = place.low <= contact.position <= place.high
        if solution.uncertainty and (stated := solution.uncertainty.von_mises):
            inside = self.sampler.inside_of(solution, self.problem.mesh)
            errors = sampled.state(solution.problem).von_mises - truth.sampled.state(self._true_law).von_mises
            within = np.abs(errors) <= ndtri((1 + LEVEL) / 2) * stated(inside)
            found["von_mises_coverage"] = float(np.average(within, weights=self.sampler.weights))
        return found

    def _fitted(self, observations: Observations, held: tuple[int, ...]) -> Solution:
        """The solution with the markers that are not held out; folds with equal markers share it."""
        if self._fit is None or self._fit[0] != held:
            self._refit = self._refit or refitter(self._solver, self.problem)
            self._fit = held, self._refit(hide_markers(observations, held))
        return self._fit[1]

    def _at_load_case(self, solution: Solution, case: int) -> SampledField:
        """A fit at the full load, carried over to a load case.

        A solver that cannot carry its fit over is solved without markers at the other load; the change that
        the markers made at the full load, times the share of the stroke, is added. If it has no solution
        without markers, its whole field counts as that change.
        """
        mesh, share = self.problem.mesh, self._task.load_cases[case].share
        if case and isinstance(self._solver, Transferable):
            solution = self._solver.transferred(solution, self.problem, self._at(case))
        sampled = self.sampler.of_solution(solution, mesh)
        if case == 0 or isinstance(self._solver, Transferable):
            return sampled
        try:
            there, here = (self._without_markers(each)[1] for each in (case, 0))
        except UnsupportedProblemError:
            return sampled * share
        return there + (sampled + here * -1.0) * share

    def _at(self, case: int) -> Problem:
        return replace(self.problem, load=self._task.load_cases[case].load)

    def _without_markers(self, case: int) -> tuple[Solution, SampledField]:
        """The solver's solution without markers at a load case, and its field; solved once."""
        if case not in self._unassimilated:
            solution = solved(self._solver, self._at(case))
            self._unassimilated[case] = solution, self.sampler.of_solution(solution, self.problem.mesh)
        return self._unassimilated[case]


def _kept(path: Path, settings: Mapping[str, Any]) -> dict[Fold, FoldResult]:
    """The results of an earlier run with these settings."""
    if not path.exists():
        return {}
    content = _FILE.validate_json(path.read_bytes())
    return {result.fold: result for result in content.results} if content.settings == settings else {}


def sweep_weights(task: SolverTask, progress: Progress = silent) -> dict[str, list[float]]:
    """The L-curve of `fem-asm`: its errors for all `FACTORS` of the weights, all markers given, first seed.

    Returns:
        Columns: `factor`; `in_sample_mm` and `left_out_mm`, root mean squares over the markers' components
        with each marker given and held out; relative L2 distances from the truth by the names of `FIELDS`.
    """
    solver = task.variant.make(0)
    if not isinstance(solver, FemAsmSolver):
        raise TypeError(f"{solver.name} has no minimisers for all weights")
    runner = FoldRunner(task, solver)
    problem = replace(runner.problem, observations=task.observations[0][0])
    solution = solver.solve(problem)
    finger, misfit = solver.prepare(problem)
    forces, space = finger.forces(misfit), LagrangeSpace(problem.mesh, solver.degree)
    rows = []
    for number, factor in enumerate(FACTORS.tolist()):
        progress(number / len(FACTORS), f"{factor:.3g} times the weight")
        fit = forces.fit(factor)
        weighted = replace(solution, field=LagrangeField(space, finger.under(fit.forces)))
        distances = runner.distances(runner.sampler.of_solution(weighted, problem.mesh), 0)
        errors = [root_mean_square(fit.residual), root_mean_square(fit.residual_without)]
        rows.append([factor, *errors, *(distances[name] for name in FIELDS)])
    finger.equilibrium.factors.destroy()
    names = ("factor", "in_sample_mm", "left_out_mm", *FIELDS)
    return {name: list(column) for name, column in zip(names, zip(*rows, strict=True), strict=True)}

"""One solver in its folds, in a process of its own."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import ndtri

from pinnray.comparison.evaluation.deformed_body import DeformedBody
from pinnray.comparison.evaluation.truths import SLIDING, Truth
from pinnray.geometry.observations import Observations
from pinnray.runtime.errors import UserError
from pinnray.solvers.problem import Load, Problem
from pinnray.solvers.solution import Solution, indenter_forces
from pinnray.solvers.solver import (
    Solver,
    Traits,
    Transferable,
    UnsupportedProblemError,
    refitter,
    solved,
    with_law,
)
from pinnray.studies.crossval.folds import ALL, Fold, LoadCase, hide_markers
from pinnray.studies.crossval.scores import LEVEL
from pinnray.studies.crossval.study import of_draw
from pinnray.studies.crossval.true_fields import FieldSampler, SampledField, TrueField
from pinnray.studies.sweep.measurement import Measurement


@dataclass(frozen=True, eq=False)
class SolverTask:
    """All that a process needs to run one solver.

    Attributes:
        name: What its failure is called.
        problem: Finger, mesh, material and the full load, without markers.
        solver: The solver.
        load_cases: The loads, the full one first.
        truths: The true fields at each load; empty with measurements.
        observations: For each seed, the markers at every load.
        folds: The markers and loads to hold out, with the name of each sample, for each seed.
        truth: The truth of these fields; None with measurements.
    """

    name: str
    problem: Problem
    solver: Solver
    load_cases: Sequence[LoadCase]
    truths: Sequence[TrueField]
    observations: Sequence[Sequence[Observations]]
    folds: Mapping[int, Mapping[str, Fold]]
    truth: Truth | None = SLIDING

    def told(self, load: Load) -> Load:
        """The load that the solver is given for one that is asked for."""
        return load if self.truth is None else self.truth.reached(load)


def run_folds(task: SolverTask, report: Callable[..., None]) -> list[Measurement]:
    """Run a solver through its folds, and report the sample of each as soon as it is known.

    Returns:
        Nothing; a failed sample with the error message if the solver fails.
    """
    runner = None
    try:
        for seed, folds in task.folds.items():
            solver = of_draw(task.solver, seed)
            if runner is None or "seed" in solver.settings():
                runner = FoldRunner(task, solver)
            for name, fold in folds.items():
                report(runner.sample(name, task.observations[seed], fold))
    except UserError as error:
        return [Measurement(task.name, "failed", str(error), 0.0)]
    return []


class FoldRunner:
    """One solver on one mesh, with the work that folds share.

    Attributes:
        problem: The problem without markers, at the full load, with the solver's law.
        sampler: The points at which fields are sampled.
    """

    def __init__(self, task: SolverTask, solver: Solver) -> None:
        self._task, self._solver = task, solver
        mesh, material = task.problem.mesh, task.problem.material
        load = task.told(task.problem.load)
        self.problem = replace(task.problem, material=with_law(material, solver), load=load)
        self._true_law = replace(self.problem, material=(task.truth or SLIDING).material(material))
        markers = task.observations[0][0]
        self.sampler = FieldSampler.of(mesh, markers.points, markers.marker_radius)
        self._body, self._truths = DeformedBody(mesh), task.truths
        self._unassimilated: dict[int, tuple[Solution, SampledField]] = {}
        self._refit: Callable[[Observations], Solution] | None = None
        self._fit: tuple[Observations, tuple[int, ...], Solution] | None = None

    def sample(self, name: str, observations: Sequence[Observations], fold: Fold) -> Measurement:
        """One fold, of which `observations` holds the markers at every load; see `scores.left_out_table`."""
        started = time.perf_counter()
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
        values: dict[str, Any] = {"errors_mm": errors.tolist(), "deviations_mm": deviations}
        if self._truths:
            true = self._truths[fold.load_case].sampled
            values |= sampled.distances(true, own, self._true_law, self.sampler.weights)
            if fold.scheme == ALL:
                values |= self._against_truth(solution, sampled)
        return Measurement(
            name,
            "done" if status.converged else "not converged",
            "; ".join(against),
            time.perf_counter() - started,
            values,
        )

    def _against_truth(self, solution: Solution, sampled: SampledField) -> dict[str, Any]:
        """Force, place of the contact and stated intervals against the truth at the full load."""
        truth, identified = self._truths[0], solution.identified
        found: dict[str, Any] = {}
        if np.isfinite(solution.reaction).all():
            force, _ = indenter_forces(self.problem.load, solution.reaction, identified)
            found["force_error"] = float(force / truth.force - 1)
        if identified:
            (_, low, high), (_, left, right) = identified.force, identified.tangential_force
            found["force_half_width"] = float((high - low) / (2 * abs(truth.force)))
            found["force_within_stated"] = low <= truth.force <= high
            found["tangential_within_stated"] = left <= truth.tangential <= right
            if place := identified.position:
                found["position_error_mm"] = place.value - truth.position
                found["position_within_stated"] = place.low <= truth.position <= place.high
        if solution.uncertainty and (stated := solution.uncertainty.von_mises):
            inside = self.sampler.inside_of(solution, self.problem.mesh)
            errors = sampled.state(solution.problem).von_mises - truth.sampled.state(self._true_law).von_mises
            within = np.abs(errors) <= ndtri((1 + LEVEL) / 2) * stated(inside)
            found["von_mises_within_stated"] = float(np.average(within, weights=self.sampler.weights))
        return found

    def _fitted(self, observations: Observations, held: tuple[int, ...]) -> Solution:
        """The solution with the markers that are not held out; folds with equal markers share it."""
        if self._fit is None or self._fit[0] is not observations or self._fit[1] != held:
            self._refit = self._refit or refitter(self._solver, self.problem)
            self._fit = observations, held, self._refit(hide_markers(observations, held))
        return self._fit[2]

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
            return SampledField(*(share * each for each in sampled))
        triples = zip(there, sampled, here, strict=True)
        return SampledField(*(plain + share * (fitted - before) for plain, fitted, before in triples))

    def _at(self, case: int) -> Problem:
        return replace(self.problem, load=self._task.told(self._task.load_cases[case].load))

    def _without_markers(self, case: int) -> tuple[Solution, SampledField]:
        """The solver's solution without markers at a load case, and its field; solved once."""
        if case not in self._unassimilated:
            solution = solved(self._solver, self._at(case))
            self._unassimilated[case] = solution, self.sampler.of_solution(solution, self.problem.mesh)
        return self._unassimilated[case]

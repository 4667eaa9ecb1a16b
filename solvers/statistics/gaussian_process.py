"""`gp`: a Gaussian process through the markers, without mechanics: the null model.

A solver with mechanics has to predict held-out markers better than this.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pinnray.geometry.observations import Observations
from pinnray.solvers.assimilation.misfit import leave_one_out_displacements, standard_deviations
from pinnray.solvers.assimilation.picture_frames import FramedData, FreePictures
from pinnray.solvers.energy_and_force import energy_and_force
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution, Status, Uncertainty
from pinnray.solvers.solver import (
    Cost,
    FieldSettings,
    Progress,
    UnsupportedProblemError,
    check_problem,
    silent,
)
from pinnray.solvers.statistics.posterior import FramedMarkers, Posterior

MIN_MARKERS = 3
"""Minimum number of markers that determines the two hyperparameters of a kernel."""


@dataclass(frozen=True)
class GaussianProcessSolver(FieldSettings):
    """u and v as independent processes of mean zero with a kernel of Matérn.

    Length and variance of each kernel maximise the marginal likelihood, also of the markers that remain when
    one is left out.
    """

    name = "gp"
    family = "statistics"
    laws = ("linear",)
    loads = ("mean", "point", "patch", "cylinder")  # it only needs to know where, for its force
    friction = True
    assimilates = True
    cost = Cost(per_triangle=38)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Fit the processes to the problem's observations, and again without each marker; see `Solver`."""
        check_problem(self, problem)
        started = time.perf_counter()
        solution, posterior, pictures = self._fitted(problem, MIN_MARKERS + 1)
        missed = np.empty_like(pictures.shown)
        for marker, observed in enumerate(pictures.shown):
            progress(marker / len(pictures.points), "leaving each marker out")
            others = Posterior.of(posterior.data.without(marker))
            missed[marker] = observed - others.shown(pictures, pictures.points[[marker]])[0]
        stats = {**solution.stats, "seconds": time.perf_counter() - started}
        return replace(solution, stats=stats, left_out=leave_one_out_displacements(problem, missed))

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """A function that fits other observations, without leaving any out; see `Refittable`."""
        return lambda observations: self._fitted(replace(problem, observations=observations), MIN_MARKERS)[0]

    def _fitted(self, problem: Problem, least: int) -> tuple[Solution, Posterior, FreePictures]:
        """The solution, and the processes conditioned on at least so many markers."""
        started, observations = time.perf_counter(), problem.observations
        count = 0 if observations is None else int(observations.visible.sum())
        if observations is None or count < least:
            raise UnsupportedProblemError(
                f"gp goes through markers: it needs {least} that were seen, not {count}"
            )
        pictures, deviations = FreePictures.of(observations), standard_deviations(observations)

        def conditioned(framed: FramedData) -> Posterior:
            return Posterior.of(FramedMarkers(pictures.points, framed.observed, deviations, framed.frames))

        z = pictures.found(lambda framed: conditioned(framed).frames[0])
        posterior = conditioned(pictures.about(z))
        (u, v), frames, free = posterior.lengths.tolist(), posterior.frames, bool(pictures.parameters)
        energy, reaction = energy_and_force(problem, posterior, 4)
        solution = Solution(
            solver=self.name,
            problem=problem,
            field=posterior,
            energy=energy,
            reaction=reaction,
            status=Status(
                True,
                f"an interpolation of the markers without mechanics, over lengths of {u:.3g} mm in u and "
                f"{v:.3g} mm in v; its energy and force mean little",
            ),
            stats={
                "seconds": time.perf_counter() - started,
                "length_u": u,
                "length_v": v,
                "log_evidence": posterior.log_evidence,
                **pictures.numbers(*frames),
            },
            uncertainty=Uncertainty(
                posterior.standard_deviation,
                shown=partial(posterior.shown_deviation, pictures) if free else None,
            ),
            pictures=pictures.at(frames[0]) if free else None,
        )
        return solution, posterior, pictures

"""Parameters of the linear finger and its `mean` or `point` load, fitted to the markers."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from geometry.arrays import FloatArray
from geometry.observations import Observations
from solvers.assimilation.estimation import Prediction, estimate
from solvers.assimilation.misfit import leave_one_out_displacements
from solvers.fem.identification.linear_model import LinearModel
from solvers.fem.identification.linear_parameters import parameters_of, problem_with
from solvers.fem.identification.linear_response import ObservationModel, Response
from solvers.identification.summary import estimate_sentence, estimate_stats
from solvers.lagrange import LagrangeField, LagrangeSpace
from solvers.problem import Problem
from solvers.solution import Solution, Status
from solvers.solver import Progress, silent


@dataclass(frozen=True, eq=False)
class LinearFit:
    """A linear finger whose parameters can be found for any observations.

    Attributes:
        problem: With the values of everything else.
        model: The finger as a function of its parameters.
        names: The parameters.
        prior: Factor of the standard deviations of the priors.
        reaction: Force along y per depth and its standard deviation, N/mm, if it was measured.
        marker_radius: Of the discs, mm; None: the observations' own.
    """

    problem: Problem
    model: LinearModel
    names: tuple[str, ...]
    prior: float = 1.0
    reaction: tuple[float, float] | None = None
    marker_radius: float | None = None

    @classmethod
    def of(cls, problem: Problem, names: Sequence[str], degree: int, **settings: Any) -> "LinearFit":
        """On elements of a degree; the settings are the attributes from `prior` on."""
        model = LinearModel(problem, LagrangeSpace(problem.mesh, degree), names)
        return cls(problem, model, tuple(names), **settings)

    def solution(self, name: str, observations: Observations, progress: Progress = silent) -> Solution:
        """The solution with the parameters that were found, under a solver's name."""
        started = time.perf_counter()
        model, problem = self.model, replace(self.problem, observations=observations)
        observed = ObservationModel.of(problem, model.space, observations, self.marker_radius)
        if self.reaction is not None:
            observed = observed.with_reaction(problem, *self.reaction)

        def predict(values: FloatArray) -> Prediction:
            said = zip(self.names, values, strict=True)
            progress(0.5, " ".join(f"{name} {value:.4g}" for name, value in said))
            return observed.predicted(model.response(values))

        parameters = parameters_of(problem, self.names, self.prior)
        found = estimate(predict, observed.observed, observed.deviations, parameters)
        response = model.response(found.values)
        missed = observed.missed(found)
        return Solution(
            solver=name,
            problem=problem_with(problem, dict(zip(self.names, found.values.tolist(), strict=True))),
            field=LagrangeField(model.space, response.nodal),
            energy=response.energy,
            reaction=_reaction(problem, response),
            status=Status(found.converged, estimate_sentence(found, missed)),
            stats={
                "seconds": time.perf_counter() - started,
                "unknowns": response.nodal.size,
                "triangles": len(problem.mesh.triangles),
                "degree": model.space.degree,
                **estimate_stats(found),
            },
            left_out=leave_one_out_displacements(problem, -observed.missed_without_each(found)),
        )

    def transferred(self, solution: Solution, other: Problem) -> Solution:
        """The solution of another problem with the parameters of a solution of this one.

        Those of finger and clamp stay. The contact keeps its distance from the nominal place, and from the
        nominal travel the same fraction of the travel.
        """
        share = float(np.linalg.norm(other.load.values) / np.linalg.norm(self.problem.load.values))
        values = []
        here, there = (parameters_of(problem, self.names) for problem in (self.problem, other))
        for before, now in zip(here, there, strict=True):
            found = float(solution.stats[before.name])
            off = {"position": 1.0, "stroke_u": share, "stroke_v": share}.get(before.name)
            values.append(found if off is None else now.start + off * (found - before.start))
        model = LinearModel(other, self.model.space, self.names)
        response = model.response(np.array(values))
        model.close()
        return replace(
            solution,
            problem=problem_with(other, dict(zip(self.names, values, strict=True))),
            field=LagrangeField(model.space, response.nodal),
            energy=response.energy,
            reaction=_reaction(other, response),
            left_out=None,
        )


def _reaction(problem: Problem, response: Response) -> FloatArray:
    """Force of the indenter, shape (2,), N/mm."""
    reaction = np.zeros(2)
    reaction[problem.load.prescribed] = response.forces
    return reaction

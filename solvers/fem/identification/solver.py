"""`fem-id`: parameters of load, clamp and material fitted to the markers by finite elements."""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import ClassVar, Literal, get_args

import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.observations import Observations
from solvers.assimilation.estimation import Estimate, Prediction, estimate
from solvers.assimilation.misfit import leave_one_out_displacements
from solvers.fem.finite_strain.solver import FemNonlinearSolver
from solvers.fem.identification.finite_strain_model import PARAMETERS, FiniteStrainModel
from solvers.fem.identification.linear_model import LinearModel
from solvers.fem.identification.parameters import parameters_of, parse_parameters, problem_with
from solvers.fem.identification.response import ObservationModel, Response
from solvers.fem.identification.summary import sentence
from solvers.fem.linear import FemSolver
from solvers.lagrange import LagrangeField, LagrangeSpace
from solvers.problem import Problem
from solvers.solution import Solution, Status
from solvers.solver import Progress, check_problem, silent

Model = Literal["fem", "fem-nonlinear"]


@dataclass(frozen=True)
class FemIdSolver:
    """`fem` with parameters of load, clamp and material fitted to the markers.

    Attributes:
        model: "fem", or "fem-nonlinear" for finite strain, where the base is rigid and walls are as drawn.
        parameters: Names of the parameters to find, with commas between them, of
            `solvers.fem.identification.parameters.MEANINGS`.
        prior: Factor of the parameters' prior standard deviations.
        reaction: Measured force of the indenter on the finger along y per depth, N/mm; None if there is none.
        reaction_error: Standard deviation of the reaction over its size.
        degree: Degree of the elements, 1 or 2.
        marker_radius: Radius of the discs over which the displacement is averaged, mm; None: that of the
            observations; zero: the markers' centres alone.
    """

    model: Model = "fem"
    parameters: str = "position,stroke_u,stroke_v"
    prior: float = 1.0
    reaction: float | None = None
    reaction_error: float = 0.02
    degree: int = 2
    marker_radius: float | None = None
    name: ClassVar[str] = "fem-id"
    loads: ClassVar[tuple[str, ...]] = ("mean", "point")
    assimilates: ClassVar[bool] = True

    def __post_init__(self) -> None:
        names = self._names
        if self.model not in get_args(Model):
            raise UserError(f"fem-id: model must be {' or '.join(get_args(Model))}, got {self.model!r}")
        if self.model == "fem-nonlinear" and (linear := sorted(set(names) - set(PARAMETERS))):
            raise UserError(f"fem-id finds {', '.join(linear)} with model=fem only")
        if "young" in names and self.reaction is None:
            raise UserError(
                "fem-id cannot find young from displacements alone: the load is a displacement, so that "
                "Young's modulus cancels out of the displacement everywhere; give reaction=, N/mm"
            )
        if self.degree not in (1, 2):
            raise UserError(f"fem-id has elements of degree 1 and 2, not {self.degree}")
        for name in ("prior", "reaction_error"):
            if not (np.isfinite(value := getattr(self, name)) and value > 0):
                raise UserError(f"fem-id: {name} must be positive, got {value}")
        if self.reaction is not None and not (np.isfinite(self.reaction) and self.reaction):
            raise UserError(
                f"fem-id: the reaction must be a force other than zero, N/mm, got {self.reaction}"
            )
        if self.marker_radius is not None and not 0 <= self.marker_radius < np.inf:
            raise UserError(f"fem-id: marker_radius must be zero or more, got {self.marker_radius}")

    @property
    def laws(self) -> tuple[str, ...]:
        """Those of the model."""
        return self._plain().laws

    @property
    def _names(self) -> tuple[str, ...]:
        return parse_parameters(self.name, self.parameters)

    def _plain(self) -> FemSolver | FemNonlinearSolver:
        """The model without any parameters to find."""
        if self.model == "fem":
            return FemSolver(degree=self.degree, estimate=False)
        return FemNonlinearSolver(degree=self.degree)

    def settings(self) -> dict[str, object]:
        """Parameters, model, prior and elements."""
        return asdict(self)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Find the parameters and solve with them; see `Solver`. Without observations it is its model."""
        check_problem(self, problem)
        if problem.observations is not None:
            fem = self._model(problem)
            solution = self._fitted(fem, problem, problem.observations, progress)
            fem.close()
            return solution
        plain = self._plain().solve(problem, progress)
        said = f"without markers, this is {self.model}: {plain.status.message}"
        return replace(plain, solver=self.name, status=Status(plain.status.converged, said))

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """A function that finds the parameters for other observations; see `Refittable`."""
        fem = self._model(problem)
        return lambda observations: self._fitted(
            fem, replace(problem, observations=observations), observations, silent
        )

    def transferred(self, solution: Solution, problem: Problem, other: Problem) -> Solution:
        """The solution of another problem with the parameters found for the first one.

        Those of finger and clamp stay. The contact keeps its distance from the nominal place, and from the
        nominal travel the same fraction of the travel.
        """
        names = self._names
        share = float(np.linalg.norm(other.load.values) / np.linalg.norm(problem.load.values))
        values = []
        for before, now in zip(parameters_of(problem, names), parameters_of(other, names), strict=True):
            found = float(solution.stats[before.name])
            off = {"position": 1.0, "stroke_u": share, "stroke_v": share}.get(before.name)
            values.append(found if off is None else now.start + off * (found - before.start))
        fem = self._model(other)
        response = fem.response(np.array(values))
        fem.close()
        return replace(
            solution,
            problem=problem_with(other, dict(zip(names, values, strict=True))),
            field=LagrangeField(fem.space, response.nodal),
            energy=response.energy,
            reaction=_reaction(other, response),
            left_out=None,
        )

    def _model(self, problem: Problem) -> LinearModel | FiniteStrainModel:
        space = LagrangeSpace(problem.mesh, self.degree)
        return (LinearModel if self.model == "fem" else FiniteStrainModel)(problem, space, self._names)

    def _fitted(
        self,
        fem: LinearModel | FiniteStrainModel,
        problem: Problem,
        observations: Observations,
        progress: Progress,
    ) -> Solution:
        started = time.perf_counter()
        names = self._names
        observed = ObservationModel.of(problem, fem.space, observations, self.marker_radius)
        if self.reaction is not None:
            deviation = self.reaction_error * abs(self.reaction)
            observed = observed.with_reaction(problem, self.reaction, deviation)

        def model(values: FloatArray) -> Prediction:
            progress(0.5, " ".join(f"{name} {value:.4g}" for name, value in zip(names, values, strict=True)))
            return observed.predicted(fem.response(values))

        found = estimate(
            model, observed.observed, observed.deviations, parameters_of(problem, names, self.prior)
        )
        response = fem.response(found.values)
        own = problem_with(problem, dict(zip(names, found.values.tolist(), strict=True)))
        return Solution(
            solver=self.name,
            problem=own,
            field=LagrangeField(fem.space, response.nodal),
            energy=response.energy,
            reaction=_reaction(problem, response),
            status=Status(found.converged, sentence(found, observed.missed(found))),
            stats={
                "seconds": time.perf_counter() - started,
                "unknowns": response.nodal.size,
                "triangles": len(problem.mesh.triangles),
                "degree": self.degree,
                **statistics(found),
            },
            left_out=leave_one_out_displacements(problem, -observed.missed_without_each(found)),
        )


def _reaction(problem: Problem, response: Response) -> FloatArray:
    """Force of the indenter, shape (2,), N/mm."""
    reaction = np.zeros(2)
    reaction[problem.load.prescribed] = response.forces
    return reaction


def statistics(found: Estimate) -> dict[str, float | int | str]:
    """The estimate for tables: each parameter, how well it is known, and the singular values."""
    numbers: dict[str, float | int | str] = {"evaluations": found.evaluations, "inflation": found.inflation}
    columns = zip(
        found.parameters, found.values, found.deviations, found.intervals, found.resolution, strict=True
    )
    for parameter, value, deviation, (low, high), resolution in columns:
        numbers |= {
            parameter.name: float(value),
            f"{parameter.name}_deviation": float(deviation),
            f"{parameter.name}_low": float(low),
            f"{parameter.name}_high": float(high),
            f"{parameter.name}_resolution": float(resolution),
        }
    singular = {f"singular_value_{n}": float(value) for n, value in enumerate(found.singular_values, 1)}
    return numbers | singular | {"condition": found.condition}

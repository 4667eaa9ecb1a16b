"""`fem-id`: contact, walls and law from the markers, by finite elements."""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import ClassVar, Literal, get_args

from geometry.errors import UserError
from geometry.observations import Observations
from solvers.fem.finite_strain.solver import FemNonlinearSolver
from solvers.fem.identification.body import FemBody
from solvers.fem.identification.linear_fit import LinearFit
from solvers.fem.identification.linear_parameters import MEANINGS
from solvers.fem.linear import FemSolver
from solvers.identification.hypothesis import Unknowns, parse_names
from solvers.identification.identifier import Identifier
from solvers.identification.settings import IdentificationSettings
from solvers.identification.solution import identified_solution
from solvers.identification.transfer import transferred
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem
from solvers.solution import Solution, Status
from solvers.solver import Family, Progress, check_problem, silent

Model = Literal["fem-nonlinear", "fem"]


@dataclass(frozen=True, kw_only=True)
class FemIdSolver(IdentificationSettings):
    """Finite elements whose contact, walls and law are found from the markers.

    Attributes:
        model: "fem-nonlinear": finite strain under an unknown force (`IdentificationSettings`); "fem": the
            linear law under a prescribed displacement, whose parameters are those of
            `solvers.fem.identification.linear_parameters.MEANINGS`.
        degree: Degree of the elements, 1 or 2.
    """

    model: Model = "fem-nonlinear"
    degree: int = 2
    name: ClassVar[str] = "fem-id"
    family: ClassVar[Family] = "finite elements"

    def __post_init__(self) -> None:
        if self.model not in get_args(Model):
            raise UserError(f"fem-id: model must be {' or '.join(get_args(Model))}, got {self.model!r}")
        if self.degree not in (1, 2):
            raise UserError(f"fem-id has elements of degree 1 and 2, not {self.degree}")
        self.check(self._linear_names if self.model == "fem" else self.unknowns)

    @property
    def laws(self) -> tuple[str, ...]:
        """Those of the model."""
        return self._plain().laws

    @property
    def loads(self) -> tuple[str, ...]:
        """Every load at finite strain, where only the drawn contact is taken from it."""
        return ("mean", "point") if self.model == "fem" else FemNonlinearSolver.loads

    def settings(self) -> dict[str, object]:
        """Parameters, model, prior and elements."""
        return asdict(self)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Find the parameters and solve with them; see `Solver`. Without observations it is its model."""
        check_problem(self, problem)
        if problem.observations is None:
            plain = self._plain().solve(problem, progress)
            said = f"without markers, this is {self.model}: {plain.status.message}"
            return replace(plain, solver=self.name, status=Status(plain.status.converged, said))
        return self._fitter(problem)(problem.observations, progress)

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """A function that finds the parameters for other observations; see `Refittable`."""
        return self._fitter(problem)

    def transferred(self, solution: Solution, problem: Problem, other: Problem) -> Solution:
        """The solution at another load with the finger of a solution; see `transfer` and `LinearFit`."""
        if self.model == "fem":
            return self._linear(problem).transferred(solution, other)
        return transferred(solution, problem, other)

    def _fitter(self, problem: Problem) -> Callable[..., Solution]:
        """A function of observations and progress, with the work that fits share."""
        if self.model == "fem":
            linear = self._linear(problem)
            return lambda observations, progress=silent: linear.solution(self.name, observations, progress)
        identifier = self._identifier(problem)

        def fitted(observations: Observations, progress: Progress = silent) -> Solution:
            started = time.perf_counter()
            found = identifier.identify(observations, self.measured_reaction, progress)
            own = replace(problem, observations=observations)
            stats = {
                "seconds": time.perf_counter() - started,
                "unknowns": found.best.response.state.size,
                "triangles": len(problem.mesh.triangles),
                "degree": self.degree,
            }
            return identified_solution(self.name, own, found, stats)

        return fitted

    def _identifier(self, problem: Problem) -> Identifier:
        def body(unknowns: Unknowns) -> FemBody:
            space = LagrangeSpace(problem.mesh, self.degree)
            return FemBody(unknowns.problem, space, unknowns.motion)

        return self.identifier(problem, body)

    @property
    def _linear_names(self) -> tuple[str, ...]:
        return parse_names(self.name, self.parameters or "position,stroke_u,stroke_v", tuple(MEANINGS))

    def _linear(self, problem: Problem) -> LinearFit:
        return LinearFit.of(
            problem,
            self._linear_names,
            self.degree,
            prior=self.prior,
            reaction=self.measured_reaction,
            marker_radius=self.marker_radius,
        )

    def _plain(self) -> FemSolver | FemNonlinearSolver:
        """The model without anything to find."""
        if self.model == "fem":
            return FemSolver(degree=self.degree, estimate=False)
        return FemNonlinearSolver(degree=self.degree)

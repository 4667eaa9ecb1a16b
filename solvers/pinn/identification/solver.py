"""`pinn-id`: contact, walls and law from the markers, by a finite-basis network."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.observations import Observations
from solvers.elasticity import LawName
from solvers.identification.contradiction import with_doubts
from solvers.identification.fit import Fit
from solvers.identification.model import ResponseModel
from solvers.identification.result import Identified
from solvers.identification.search import Identifier, carried
from solvers.identification.settings import IdentifyingSolver
from solvers.identification.unknowns import DEFAULT, LAWS, Unknowns
from solvers.pinn.finite_basis.presets import PinnLocalSolver
from solvers.pinn.identification.network_body import NetworkBody
from solvers.problem import Problem
from solvers.solution import Solution, Status
from solvers.solver import Family, Progress, check_problem, silent

SEARCHED, SOLVED = 0.6, 0.45
"""Cell of the quadrature, in window spacings, where the unknowns are sought and of the final network.

On the default finger the von Mises stress of the final network is 3.2 % from `fem-id`, with the search's cell
3.6 %; `fem` is itself 2.6 % from converged elements. With the windows of `pinn-std` it is 2.9 %, but Newton's
method then found no equilibrium for three of eight truths.
"""
COARSE_ERROR, FINE_ERROR, FINAL_ERROR = 0.005, 0.001, 0.0003
"""Error of the network on each level over the largest displacement of a marker: it adds to the markers'."""


@dataclass(frozen=True, kw_only=True)
class PinnIdSolver(IdentifyingSolver):
    """A finite-basis network at finite strain, whose contact, walls and law are found from the markers.

    One law is fitted on a coarse level, from there all laws on a fine one; the network's error on each counts
    as the markers'. The equilibrium of the most probable law is then solved for by a final network, which is
    finer still, and the unknowns are improved to first order; the change is part of the deviations. Refits to
    other observations of the same markers are of first order.

    Attributes:
        coarse: Spacing of the windows on the coarse level over the spacing of the preset `local`.
        fine: Spacing on the fine level over the spacing of the preset `local`.
        seed: Of the random numbers.
    """

    coarse: float = 2.2
    fine: float = 1.5
    seed: int = 0
    name: ClassVar[str] = "pinn-id"
    family: ClassVar[Family] = "neural network"
    twin: ClassVar[str] = "fem-id"
    sought: ClassVar[tuple[str, ...]] = tuple(name for name in DEFAULT if name != "feet")
    laws: ClassVar[tuple[str, ...]] = LAWS
    loads: ClassVar[tuple[str, ...]] = ("mean", "point", "patch", "cylinder")
    friction: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if not 0 < self.fine <= self.coarse:
            raise UserError(f"pinn-id needs 0 < fine <= coarse, got {self.fine} and {self.coarse}")
        if self.seed < 0:
            raise UserError(f"pinn-id: the seed must be zero or more, got {self.seed}")
        super().__post_init__()

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Find the unknowns and solve with them; see `Solver`. Without markers it solves for the load."""
        check_problem(self, problem)
        if problem.observations is not None:
            found = with_doubts(
                lambda given: self._solved(problem, given, progress)[0],
                problem.observations,
                lambda given: self._identifier(problem, self.coarse).expected(given),
            )
            progress(1.0, found.force_phrase)
            return found
        network = self._network
        level = replace(
            network,
            wall_spacing=self.fine * network.wall_spacing,
            corner_spacing=self.fine * network.corner_spacing,
            growth=self.fine * network.growth,
            tolerance=0.02,
        )
        plain = level.solve(problem, progress)
        said = f"without markers, this is pinn-std with preset=local: {plain.status.message}"
        return replace(plain, solver=self.name, status=Status(plain.status.converged, said))

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """A function that finds the unknowns for other observations; see `Refittable`.

        Where no marker has moved by 0.2 mm more or less than in the first fit, it is of first order.
        """
        kept: list[tuple[Observations, Identifier, Identified]] = []

        def refit(observations: Observations) -> Solution:
            if kept and _near(observations, kept[0][0]):
                started = time.perf_counter()
                _, identifier, found = kept[0]
                again = identifier.updated(found, _with_error(observations, FINAL_ERROR))
                return self._solution(replace(problem, observations=observations), again, started, 0.0)
            solution, identifier, found = self._solved(problem, observations, silent)
            if observations.visible.all() and not found.doubtful:
                kept[:] = [(observations, identifier, found)]
            return solution

        return refit

    def _solved(
        self, problem: Problem, observations: Observations, progress: Progress
    ) -> tuple[Solution, Identifier, Identified]:
        started = time.perf_counter()
        problem = replace(problem, observations=observations)
        law: LawName = LAWS[0] if self.law == "evidence" else problem.material.law
        coarse, fine = self._identifier(problem, self.coarse, [law]), self._identifier(problem, self.fine)
        first = coarse.identify(
            _with_error(observations, COARSE_ERROR), lambda share, text: progress(0.4 * share, text)
        ).best
        coarse_seconds = time.perf_counter() - started
        start = carried(first.response, _projected(first, fine.models[law]))
        fine.start_from(first._replace(model=fine.models[law], response=start))
        found = fine.identify(
            _with_error(observations, FINE_ERROR), lambda share, text: progress(0.4 + 0.4 * share, text)
        )
        progress(0.8, f"{found.best.law}: finer")
        best, *others = found.fits
        refined = self._refined(fine, best, _with_error(observations, FINAL_ERROR))
        found = replace(found, fits=[refined, *others])
        return self._solution(problem, found, started, coarse_seconds), fine, found

    def _refined(self, identifier: Identifier, fit: Fit, observations: Observations) -> Fit:
        """A fit by the final network; if that finds no equilibrium, the given one, marked as inexact."""
        unknowns = fit.model.unknowns
        network = replace(self._network, cell=SOLVED)
        model = ResponseModel(NetworkBody.of(network, unknowns.problem, unknowns.motion), unknowns)
        refined = identifier.refined(fit, model, _projected(fit, model), observations)
        return fit._replace(exact=False) if refined is None else refined

    def _solution(
        self, problem: Problem, found: Identified, started: float, coarse_seconds: float
    ) -> Solution:
        stats: dict[str, float | int | str] = {
            "seconds": time.perf_counter() - started,
            "coarse_seconds": coarse_seconds,
            "unknowns": found.best.response.state.size,
            "windows": len(found.best.response.state),
            "seed": self.seed,
            "device": "cpu",
        }
        return found.solution(self.name, problem, stats)

    @property
    def _network(self) -> PinnLocalSolver:
        """Fewer quadrature points and windows at corners than the preset `local` has: four times as fast."""
        return PinnLocalSolver(cell=SEARCHED, corner_spacing=0.02, seed=self.seed)

    def _identifier(
        self, problem: Problem, scale: float, laws: Sequence[LawName] | None = None
    ) -> Identifier:
        """The search on a level; the derivatives of its networks are known to 1e-3, by iteration.

        An element of the mesh that is smaller than half a quadrature cell has one point: on the default mesh
        this halves the points, at no cost in displacement.
        """

        def body(unknowns: Unknowns) -> NetworkBody:
            return NetworkBody.of(self._network, unknowns.problem, unknowns.motion, scale, 0.5)

        return Identifier(self, problem, body, laws=laws, cost_change=1e-3)


def _projected(fit: Fit, model: ResponseModel) -> FloatArray:
    """The state of another network that is nearest to a fit's."""
    here, there, hypothesis = fit.model.body, model.body, fit.response.hypothesis
    if not (isinstance(here, NetworkBody) and isinstance(there, NetworkBody)):
        raise TypeError("the bodies of pinn-id are networks")
    return there.projected(here, fit.response.state, hypothesis.lame, hypothesis.changes)


def _with_error(observations: Observations, share: float) -> Observations:
    """The observations with another error, a share of the largest displacement."""
    size = share * float(np.abs(observations.displacements[observations.visible]).max(initial=0.0))
    return replace(observations, standard_deviations=np.hypot(observations.standard_deviations, size))


def _near(observations: Observations, first: Observations) -> bool:
    """True if no marker has moved by 0.2 mm more or less than in the first observations."""
    if not np.array_equal(observations.points, first.points):
        return False
    seen = observations.visible
    moved = observations.displacements[seen] - first.displacements[seen]
    return bool(np.abs(moved).max(initial=0.0) < 0.2)

"""`pinn-id`: contact, walls and law from the markers, by a finite-basis network."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np

from pinnray.geometry.observations import Observations
from pinnray.solvers.fem.finite_strain.nested_path import coarser
from pinnray.solvers.fem.identification import FemBody
from pinnray.solvers.identification.fit import Fit
from pinnray.solvers.identification.model import Response, ResponseModel
from pinnray.solvers.identification.nested_search import ROUGHLY, NestedSearch
from pinnray.solvers.identification.result import Identified
from pinnray.solvers.identification.search import Identifier
from pinnray.solvers.identification.settings import IdentifyingSolver
from pinnray.solvers.identification.unknowns import DEFAULT, LAWS, Unknowns
from pinnray.solvers.pinn.finite_basis.presets import PinnLocalSolver
from pinnray.solvers.pinn.identification.network_body import NetworkBody
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import Cost, Family, Progress, UnsupportedProblemError, check_problem, silent

WINDOWS = PinnLocalSolver(wall_spacing=0.65, corner_spacing=0.026, growth=0.65, cell=0.42)
"""On the default finger with elements of 0.25 and 0.5 mm the von Mises stress is 4.5 and 5.2 % from the truth
of `sliding`, in 12 and 9 seconds. With spacings of 0.77 times these, and 1.5 times the work, it is 3.9 and
4.8 %; with these, a cell of 0.6 and as much work as here, 4.3 and 7.3 %."""
COST_CHANGE = 1e-3
"""Relative change of the cost below which a search by the network has converged: its derivatives are known to
a hundredth, by iteration."""
ERROR = 0.0003
"""Error of the network over the largest displacement of a marker: it adds to the markers'."""


@dataclass(frozen=True, kw_only=True)
class PinnIdSolver(IdentifyingSolver):
    """A finite-basis network at finite strain, whose contact, walls and law are found from the markers.

    The unknowns are sought by coarse finite elements, as by `fem-id`. From there the network's equilibrium
    and the unknowns are improved by turns, to first order in the unknowns, until these settle; where they do
    not, they are sought by the network. A law that is far less probable than the best one stays with the
    elements. Refits to other observations of the same markers are of first order.

    It is in plane strain, also for markers on a side face, and has the doubt of that: functions of the depth
    would quadruple its output layer, whose factors cost its third power.

    Attributes:
        spacing: Factor of the windows' spacings.
        seed: Of the random numbers.
    """

    spacing: float = 1.0
    seed: int = 0
    name: ClassVar[str] = "pinn-id"
    family: ClassVar[Family] = "neural network"
    twin: ClassVar[str] = "fem-id"
    sought: ClassVar[tuple[str, ...]] = tuple(name for name in DEFAULT if name != "feet")
    laws: ClassVar[tuple[str, ...]] = LAWS
    cost: ClassVar[Cost] = Cost(per_triangle=0, fixed=17)

    def __post_init__(self) -> None:
        self.check_positive("spacing")
        self.check_not_negative("seed")
        super().__post_init__()

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Find the unknowns and solve with them; see `Solver`."""
        check_problem(self, problem)
        if problem.observations is None:
            raise UnsupportedProblemError("pinn-id finds the contact by markers: give some, or take pinn-std")
        found, _, _ = self._solved(problem, problem.observations, progress)
        progress(1.0, found.force_phrase)
        return found

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """A function that finds the unknowns for other observations; see `Refittable`.

        Where no marker has moved by 0.2 mm more or less than in the first fit, it is of first order.
        """
        kept: list[tuple[Observations, NestedSearch, Identified]] = []

        def refit(observations: Observations) -> Solution:
            if kept and _near(observations, kept[0][0]):
                started = time.perf_counter()
                _, search, found = kept[0]
                again = search.updated(found, _with_error(observations))
                return self._solution(replace(problem, observations=observations), again, started)
            solution, search, found = self._solved(problem, observations, silent)
            if observations.visible.all() and not len(found.best.doubted):
                kept[:] = [(observations, search, found)]
            return solution

        return refit

    def _solved(
        self, problem: Problem, observations: Observations, progress: Progress
    ) -> tuple[Solution, NestedSearch, Identified]:
        started = time.perf_counter()
        problem = replace(problem, observations=observations)
        body = partial(FemBody, degree=2)
        elements = Identifier(self, coarser(problem) or problem, body, cost_change=ROUGHLY)
        network = Identifier(
            self, problem, self._body, cost_change=COST_CHANGE, flexibility=elements.flexibility
        )
        search = NestedSearch(elements, _projected, fine=network)
        found = search.identify(_with_error(observations), progress)
        return self._solution(problem, found, started), search, found

    def _solution(self, problem: Problem, found: Identified, started: float) -> Solution:
        stats: dict[str, float | int | str] = {
            "seconds": time.perf_counter() - started,
            "unknowns": found.best.response.state.size,
            "windows": len(found.best.response.state),
            "seed": self.seed,
            "device": "cpu",
        }
        return found.solution(self.name, problem, stats)

    def _body(self, unknowns: Unknowns) -> NetworkBody:
        windows = replace(WINDOWS, seed=self.seed)
        return NetworkBody.of(windows, unknowns.problem, unknowns.motion, self.spacing)


def _projected(fit: Fit, model: ResponseModel) -> Response:
    """The response of elements by the nearest states of a network."""
    body, response = model.body, fit.response
    assert isinstance(body, NetworkBody)
    elements = fit.model.unknowns.problem.mesh
    location = model.unknowns.problem.mesh.locate_on(elements, body.points)
    gradients = fit.model.body.gradients(np.stack([response.state, *response.slopes]), location)
    hypothesis = response.hypothesis
    state, *slopes = body.projected(gradients, hypothesis.lame, hypothesis.changes)
    return replace(response, state=state, slopes=np.array(slopes).reshape(-1, *state.shape))


def _with_error(observations: Observations) -> Observations:
    """The observations with the network's error, too."""
    size = ERROR * float(np.abs(observations.displacements[observations.visible]).max(initial=0.0))
    return replace(observations, standard_deviations=np.hypot(observations.standard_deviations, size))


def _near(observations: Observations, first: Observations) -> bool:
    """True if no marker has moved by 0.2 mm more or less than in the first observations."""
    if not np.array_equal(observations.points, first.points):
        return False
    seen = observations.visible
    moved = observations.displacements[seen] - first.displacements[seen]
    return bool(np.abs(moved).max(initial=0.0) < 0.2)

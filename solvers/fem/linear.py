"""`fem`: linear elasticity with DOLFINx, the reference of every comparison."""

import time
from dataclasses import dataclass, replace

from pinnray.solvers.fem.boundary_conditions import reaction_by_residual_work
from pinnray.solvers.fem.equilibrium import DiscreteEquilibrium, linear_equilibrium
from pinnray.solvers.fem.error_estimate import ErrorEstimator, locking_advice
from pinnray.solvers.lagrange import LagrangeField, LagrangeSpace
from pinnray.solvers.problem import Load, Problem
from pinnray.solvers.solution import ErrorEstimate, Solution, Status
from pinnray.solvers.solver import Cost, ElementSettings, Progress, check_problem, silent


@dataclass(frozen=True)
class FemSolver(ElementSettings):
    """Lagrange elements on exactly the shared mesh.

    A `mean` or `point` load is one linear functional b_k per prescribed component: K x_k = b_k is solved once
    for each, and the forces f follow from (b_i . x_j) f_j = prescribed displacement. A `patch` is a Dirichlet
    condition.
    """

    estimate: bool = True  # Whether to estimate the discretisation error, at half the cost of the solution
    name = "fem"
    family = "finite elements"
    laws = ("linear",)
    loads = ("mean", "point", "patch")
    cost = Cost(per_triangle=55)

    def prepare(self, problem: Problem) -> "FactorisedProblem":
        """Assemble and factorise once, to solve for many loads."""
        check_problem(self, problem)
        return FactorisedProblem(self, problem, linear_equilibrium(problem, self.degree))

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve the linear problem; see `Solver`."""
        started = time.perf_counter()
        prepared = self.prepare(problem)
        seconds = time.perf_counter() - started
        progress(0.6, "factorised")
        solution = prepared.solve(problem.load)
        prepared.destroy()
        seconds += float(solution.stats["seconds"])
        return replace(solution, stats={**solution.stats, "seconds": seconds})


class FactorisedProblem:
    """Solutions for many loads with shared factors of the stiffness.

    `mean` and `point` loads share the factorisation, wherever they act; so do patches at one place that hold
    the same components. Loads that differ in their displacement only share the responses to unit forces too.
    """

    def __init__(self, solver: FemSolver, problem: Problem, equilibrium: DiscreteEquilibrium) -> None:
        self._solver, self._problem, self._equilibrium = solver, problem, equilibrium
        self._estimator = ErrorEstimator(problem, LagrangeSpace(problem.mesh, solver.degree))

    def solve(self, load: Load) -> Solution:
        """Solve for a load; `seconds` of the solution's `stats` is the time of this call."""
        started = time.perf_counter()
        equilibrium, space = self._equilibrium, self._estimator.space
        problem = replace(self._problem, load=load)
        check_problem(self._solver, problem)
        equilibrium.prescribe(problem)
        nodal = equilibrium.linear_guess(1.0).nodal
        residual = equilibrium.internal_force(nodal)
        solved = time.perf_counter()
        error = None
        if self._solver.estimate and load.kind != "point" and load.values.any():
            error = self._estimator.estimate(nodal, equilibrium.response)
        advice = locking_advice(space.degree, problem.material)
        sentence = ["solved directly", _uncertainty(problem, error), advice]
        return Solution(
            solver=self._solver.name,
            problem=problem,
            field=LagrangeField(space, nodal),
            energy=0.5 * float((nodal * residual).sum()),
            reaction=reaction_by_residual_work(space, residual),
            status=Status(True, "; ".join(filter(None, sentence))),
            stats={
                "seconds": solved - started,
                "estimate_seconds": time.perf_counter() - solved,
                "unknowns": nodal.size,
                "triangles": len(problem.mesh.triangles),
                "degree": space.degree,
            },
            error=error,
        )

    def destroy(self) -> None:
        """Free the factors, unless others share them."""
        if not self._equilibrium.shared:
            self._equilibrium.factors.destroy()


def _uncertainty(problem: Problem, error: ErrorEstimate | None) -> str:
    """The discretisation error in words."""
    if problem.load.kind == "point":
        return "a point load has no limit under refinement, so there is no error to estimate"
    if error is None:
        return "the discretisation is the only error, and was not estimated"
    return f"the discretisation is the only error, {error.phrase}"

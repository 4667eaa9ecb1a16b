"""`fem`: linear elasticity with DOLFINx, the reference of every comparison."""

import time
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, get_args

import numpy as np
import ufl

from geometry.arrays import BoolArray, FloatArray
from geometry.errors import UserError
from solvers.constrained_elimination import ConstrainedElimination
from solvers.elasticity import energy_density_of
from solvers.fem.boundary_conditions import (
    dirichlet_displacement,
    dirichlet_mask,
    load_functionals,
    load_targets,
    reaction_by_residual_work,
)
from solvers.fem.dolfinx_compat import DistributedSpace
from solvers.fem.error_estimate import ErrorEstimator, locking_advice
from solvers.fem.linear_solvers import Factorisation, LinearSolver, Multigrid
from solvers.fem.ranks import on_all_ranks
from solvers.lagrange import LagrangeField, LagrangeSpace
from solvers.problem import Load, Problem
from solvers.solution import ErrorEstimate, Solution, Status
from solvers.solver import Family, FieldSettings, Progress, check_problem, silent

ITERATIVE_BEYOND = 10_000_000
"""Unknowns beyond which "auto" means "iterative".

MUMPS is ten times as fast at 3.9 million, but its memory (1.8 GB a million there) grows faster than that of
the iterations (1.4 GB).
"""


@dataclass(frozen=True, eq=False)
class LinearElasticity:
    """The compiled forms of the linear problem."""

    problem: Problem
    distributed: DistributedSpace[LagrangeSpace]  # The elements in DOLFINx
    force: Any
    stiffness: Any
    iterative: bool  # Whether systems are solved by multigrid, not by factorisation

    @classmethod
    def of(
        cls, problem: Problem, space: LagrangeSpace, linear_solver: LinearSolver = "auto"
    ) -> "LinearElasticity":
        """Compile the forms of a problem."""
        distributed = DistributedSpace(space)
        moduli = distributed.moduli(problem.material.lame)
        energy = energy_density_of("linear", ufl.grad(distributed.function), moduli) * ufl.dx
        iterative = linear_solver == "iterative"
        if linear_solver == "auto":
            iterative = 2 * len(space.nodes) > ITERATIVE_BEYOND
        return cls(problem, distributed, *distributed.derivatives(energy), iterative)

    def factorise(self, clamped: BoolArray) -> Factorisation | Multigrid:
        """Assemble and factorise with the components of the mask `clamped`, shape (N, 2)."""
        matrix = self.distributed.assemble_matrix(self.stiffness, self.distributed.clamp(clamped))
        if self.iterative:
            return Multigrid(self.distributed, matrix, clamped)
        return Factorisation(self.distributed, matrix, clamped, positive_definite=True)

    def internal_force(self, nodal: FloatArray) -> FloatArray:
        """Internal force K u of nodal displacements, shape (N, 2), N/mm."""
        self.distributed.set_function(nodal)
        return self.distributed.assemble_nodal(self.force)


@dataclass(frozen=True, eq=False)
class LinearEquilibrium:
    """Displacements of least energy for any values at base and contact, from one factorisation."""

    elasticity: LinearElasticity
    clamped: BoolArray  # Components with a Dirichlet condition, mask of shape (N, 2)
    factors: Factorisation | Multigrid  # Solver of the stiffness with these components clamped
    load: ConstrainedElimination  # Solves with the load's k functionals, of which a `patch` has none

    @classmethod
    def of(cls, elasticity: LinearElasticity, slack: float = 0.0) -> "LinearEquilibrium":
        """Factorise, and solve once for each functional.

        Springs of the compliance `slack`, mm per N/mm, stand between the functionals and their given values.
        """
        problem, space = elasticity.problem, elasticity.distributed.space
        clamped = dirichlet_mask(problem, space)
        factors = elasticity.factorise(clamped)
        rows = load_functionals(problem, space)
        load = ConstrainedElimination(rows, factors.solve_all(rows), slack)
        return cls(elasticity, clamped, factors, load)

    def of_problem(self, problem: Problem) -> "LinearEquilibrium":
        """The equilibrium under another load; keeps the factors and responses that still hold."""
        if problem.load == self.elasticity.problem.load:
            return self
        elasticity, space = replace(self.elasticity, problem=problem), self.elasticity.distributed.space
        if not np.array_equal(dirichlet_mask(problem, space), self.clamped):
            self.factors.destroy()
            return LinearEquilibrium.of(elasticity)
        load, functionals = self.load, load_functionals(problem, space)
        if not np.array_equal(functionals, load.rows):
            load = ConstrainedElimination(functionals, self.factors.solve_all(functionals))
        return replace(self, elasticity=elasticity, load=load)

    def solution(self) -> FloatArray:
        """The nodal displacements that solve the problem, shape (N, 2), mm."""
        problem, space = self.elasticity.problem, self.elasticity.distributed.space
        return self.minimiser(dirichlet_displacement(problem, space), load_targets(problem))

    def minimiser(self, given: FloatArray, values: FloatArray) -> FloatArray:
        """Nodal displacements (N, 2), mm, of least energy, for those given where clamped, and values (k,)."""
        nodal = np.where(self.clamped, given, 0.0)
        if nodal.any():
            nodal = nodal + self.factors.solve(-self.elasticity.internal_force(nodal))
        return self.load.solution(nodal, values)[0]

    def response(self, force: FloatArray) -> FloatArray:
        """Displacement under nodal forces, N/mm, while all given values are zero: both (N, 2), in mm."""
        return self.load.solution(self.factors.solve(force))[0]

    def responses(self, forces: FloatArray) -> FloatArray:
        """Responses to several at once, shape (r, N, 2)."""
        return np.array([self.load.solution(free)[0] for free in self.factors.solve_all(forces)])

    def residual(self, internal: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residual r, (N, 2), N/mm, of internal forces with the functionals' best forces; `response(r)`.

        It is zero where displacements are given. The square root of the product of both is its dual norm.
        """
        response, forces = self.load.solution(self.factors.solve(internal))
        return np.where(self.clamped, 0.0, internal + self.load.weighted(forces)), response


@dataclass(frozen=True)
class FemSolver(FieldSettings):
    """Lagrange elements on exactly the shared mesh.

    A `mean` or `point` load is one linear functional b_k per prescribed component: K x_k = b_k is solved once
    for each, and the forces f follow from (b_i . x_j) f_j = prescribed displacement. A `patch` is a Dirichlet
    condition.
    """

    degree: int = 2  # Of the elements, 1 or 2
    estimate: bool = True  # Whether to estimate the discretisation error, at half the cost of the solution
    # "direct" (MUMPS), "iterative" (conjugate gradients with algebraic multigrid) or "auto", which iterates
    # beyond `ITERATIVE_BEYOND` unknowns
    linear_solver: LinearSolver = "auto"
    name: ClassVar[str] = "fem"
    family: ClassVar[Family] = "finite elements"
    laws: ClassVar[tuple[str, ...]] = ("linear",)
    loads: ClassVar[tuple[str, ...]] = ("mean", "point", "patch")

    def __post_init__(self) -> None:
        self.check_degree(self.degree)
        if self.linear_solver not in get_args(LinearSolver):
            known = ", ".join(get_args(LinearSolver))
            raise UserError(f"fem has the linear solvers {known}, not {self.linear_solver!r}")

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve the linear problem; see `Solver`."""
        check_problem(self, problem)
        return on_all_ranks(self._solve, problem, progress)

    def prepare(self, problem: Problem) -> "FactorisedProblem":
        """Assemble and factorise once, to solve for many loads."""
        check_problem(self, problem)
        space = LagrangeSpace(problem.mesh, self.degree)
        elasticity = LinearElasticity.of(problem, space, self.linear_solver)
        return FactorisedProblem(self, LinearEquilibrium.of(elasticity))

    def _solve(self, problem: Problem, progress: Progress) -> Solution:
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

    def __init__(self, solver: FemSolver, equilibrium: LinearEquilibrium) -> None:
        self._solver, self._equilibrium = solver, equilibrium

    def solve(self, load: Load) -> Solution:
        """Solve for a load; `seconds` of the solution's `stats` is the time of this call."""
        started = time.perf_counter()
        problem = replace(self._equilibrium.elasticity.problem, load=load)
        check_problem(self._solver, problem)
        self._equilibrium = self._equilibrium.of_problem(problem)
        elasticity = self._equilibrium.elasticity
        nodal = self._equilibrium.solution()
        residual = elasticity.internal_force(nodal)
        solved = time.perf_counter()
        error = None
        if self._solver.estimate and load.kind != "point" and load.values.any():
            error = self._estimator.estimate(nodal, self._equilibrium.response)
        space = elasticity.distributed.space
        factors = self._equilibrium.factors
        sentence = [
            factors.message,
            _uncertainty(problem, error),
            locking_advice(space.degree, problem.material),
        ]
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
                "ranks": elasticity.distributed.comm.size,
                **factors.stats,
            },
            error=error,
        )

    @cached_property
    def _estimator(self) -> ErrorEstimator:
        elasticity = self._equilibrium.elasticity
        return ErrorEstimator(elasticity.problem, elasticity.distributed.space)

    def destroy(self) -> None:
        """Free the factors."""
        self._equilibrium.factors.destroy()


def _uncertainty(problem: Problem, error: ErrorEstimate | None) -> str:
    """The discretisation error in words."""
    if problem.load.kind == "point":
        return "a point load has no limit under refinement, so there is no error to estimate"
    if error is None:
        return "the discretisation is the only error, and was not estimated"
    return f"the discretisation is the only error, {error.phrase}"

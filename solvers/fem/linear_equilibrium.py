"""Linear elasticity: the stiffness, and equilibria for given values at base and contact."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import ufl

from geometry.arrays import BoolArray, FloatArray
from solvers.constrained_elimination import ConstrainedElimination
from solvers.elasticity import energy_density_of
from solvers.fem.boundary_conditions import (
    dirichlet_displacement,
    dirichlet_mask,
    load_functionals,
    load_targets,
)
from solvers.fem.dolfinx_compat import DistributedSpace
from solvers.fem.linear_solvers import Factorisation, LinearSolver, Multigrid
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem

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

"""Linear elasticity as least energy: the stiffness, its factorisation, and minimisers for given values."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
import ufl
from petsc4py import PETSc

from geometry.arrays import BoolArray, FloatArray
from solvers.elasticity import Lame, linear_energy_density
from solvers.fem.boundary_conditions import held_components, load_functionals, patch_displacement
from solvers.fem.dolfinx_compat import DistributedSpace, Factorisation
from solvers.fem.multigrid import Multigrid
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem

LinearSolver = Literal["auto", "direct", "iterative"]

ITERATIVE_BEYOND = 10_000_000
"""Unknowns beyond which "auto" means "iterative".

MUMPS is ten times as fast at 3.9 million, but its memory (1.8 GB a million there) grows faster than that of
the iterations (1.4 GB).
"""


@dataclass(frozen=True, eq=False)
class LinearElasticity:
    """The assembled stiffness with its boundary conditions."""

    problem: Problem
    distributed: DistributedSpace
    forms: dict[str, Any] = field(default_factory=dict)
    iterative: bool = False

    @classmethod
    def of(
        cls, problem: Problem, space: LagrangeSpace, linear_solver: LinearSolver = "auto"
    ) -> "LinearElasticity":
        """Compile the forms of a problem."""
        distributed = DistributedSpace(space)
        lame = problem.material.lame
        constants = Lame(distributed.constant(lame.λ), distributed.constant(lame.μ), lame.λ_out)
        u = distributed.function
        energy = linear_energy_density(ufl.grad(u), constants) * ufl.dx
        residual = ufl.derivative(energy, u, ufl.TestFunction(u.function_space))
        stiffness = ufl.derivative(residual, u, ufl.TrialFunction(u.function_space))
        forms = {"residual": distributed.form(residual), "stiffness": distributed.form(stiffness)}
        iterative = {
            "auto": 2 * len(space.nodes) > ITERATIVE_BEYOND,
            "direct": False,
            "iterative": True,
        }[linear_solver]
        return cls(problem, distributed, forms, iterative)

    def assemble(self, clamped: BoolArray) -> PETSc.Mat:
        """The stiffness with the components of the mask `clamped`, shape (N, 2), held."""
        conditions = [
            condition
            for axis in (0, 1)
            for condition in self.distributed.clamp(np.flatnonzero(clamped[:, axis]), (axis,))
        ]
        return self.distributed.assemble_matrix(self.forms["stiffness"], conditions)

    def factorise(self, clamped: BoolArray) -> Factorisation | Multigrid:
        """Assemble and factorise with the components of the mask `clamped`, shape (N, 2), held."""
        matrix = self.assemble(clamped)
        if self.iterative:
            return Multigrid(self.distributed, matrix, clamped)
        return Factorisation(self.distributed, matrix, clamped, positive_definite=True)

    def internal_force(self, nodal: FloatArray) -> FloatArray:
        """Internal force K u of nodal displacements, shape (N, 2), N/mm."""
        self.distributed.set_function(nodal)
        return self.distributed.assemble_nodal(self.forms["residual"])


@dataclass(frozen=True, eq=False)
class LinearEquilibrium:
    """Displacements of least energy for any values at base and contact, from one factorisation.

    Attributes:
        elasticity: The stiffness.
        held: Nodal components whose values are given, mask of shape (N, 2).
        functionals: The load's functionals whose values are given, shape (k, N, 2); none for a `patch`.
        factors: Of the stiffness with the components of `held` clamped.
        responses: Displacement under the unit force of each functional, shape (k, N, 2), mm per N/mm.
        slack: Compliance of springs through which the functionals' values are given, mm per N/mm; zero: they
            are rigid.
    """

    elasticity: LinearElasticity
    held: BoolArray
    functionals: FloatArray
    factors: Factorisation | Multigrid
    responses: FloatArray
    slack: float = 0.0

    @classmethod
    def of(cls, elasticity: LinearElasticity) -> "LinearEquilibrium":
        """Factorise, and solve once for each functional."""
        held, functionals = _held_and_functionals(elasticity)
        factors = elasticity.factorise(held)
        return cls(elasticity, held, functionals, factors, _responses(factors, functionals))

    def of_problem(self, problem: Problem) -> "LinearEquilibrium":
        """The same for another load, with what of this work serves it; what does not is freed."""
        if problem.load == self.elasticity.problem.load:
            return self
        elasticity = replace(self.elasticity, problem=problem)
        held, functionals = _held_and_functionals(elasticity)
        if not np.array_equal(held, self.held):
            self.factors.destroy()
            return LinearEquilibrium.of(elasticity)
        if np.array_equal(functionals, self.functionals):
            return replace(self, elasticity=elasticity)
        return LinearEquilibrium(
            elasticity, held, functionals, self.factors, _responses(self.factors, functionals)
        )

    @cached_property
    def compliance(self) -> FloatArray:
        """Values of the functionals, and of their springs, under unit forces, shape (k, k), mm per N/mm."""
        own = np.einsum("inx,jnx->ij", self.functionals, self.responses)
        return np.asarray(own + self.slack * np.eye(len(own)))

    def values(self, nodal: FloatArray) -> FloatArray:
        """The load's functionals of nodal displacements, shape (k,), mm."""
        return np.asarray(np.einsum("knx,nx->k", self.functionals, nodal))

    def solution(self) -> FloatArray:
        """The nodal displacements that solve the problem, shape (N, 2), mm."""
        problem, space = self.elasticity.problem, self.elasticity.distributed.space
        if problem.load.kind == "patch":
            return self.minimiser(patch_displacement(problem, space), np.zeros(0))
        return self.minimiser(np.zeros(self.held.shape), problem.load.values)

    def minimiser(self, given: FloatArray, values: FloatArray) -> FloatArray:
        """The nodal displacements of least energy, shape (N, 2), mm.

        Args:
            given: Nodal displacements whose components of `held` are taken, shape (N, 2), mm.
            values: What the functionals have to be, shape (k,), mm.
        """
        nodal = np.where(self.held, given, 0.0)
        if nodal.any():
            nodal = nodal + self.factors.solve(-self.elasticity.internal_force(nodal))
        forces = np.linalg.solve(self.compliance, values - self.values(nodal))
        return np.asarray(nodal + np.einsum("k,knx->nx", forces, self.responses))

    def response(self, force: FloatArray) -> FloatArray:
        """Displacement under nodal forces while all prescribed values are zero, (N, 2) each, N/mm and mm."""
        return self.unbalanced(force)[1]

    def unbalanced(self, internal: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What internal forces, shape (N, 2), N/mm, leave unbalanced under any forces of the functionals.

        Returns:
            Nodal forces r, shape (N, 2), N/mm, zero where displacements are given, and the displacement
            K^-1 r, mm, by which every functional is zero: the square root of their product is the dual norm
            of r.
        """
        response = self.factors.solve(internal)
        forces = np.linalg.solve(self.compliance, self.values(response))
        balance = np.where(self.held, 0.0, internal - np.einsum("k,knx->nx", forces, self.functionals))
        return balance, response - np.einsum("k,knx->nx", forces, self.responses)


def _held_and_functionals(elasticity: LinearElasticity) -> tuple[BoolArray, FloatArray]:
    """Nodal components that the load and the base hold, (N, 2), and the load's functionals, (k, N, 2)."""
    problem, space = elasticity.problem, elasticity.distributed.space
    held = held_components(problem, space)
    if problem.load.kind == "patch":
        return held, np.zeros((0, *held.shape))
    return held, load_functionals(problem, space)


def _responses(factors: Factorisation | Multigrid, functionals: FloatArray) -> FloatArray:
    """Displacement under the unit force of each functional, shape (k, N, 2), mm per N/mm."""
    return np.array([factors.solve(functional) for functional in functionals]).reshape(functionals.shape)

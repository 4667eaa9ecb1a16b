"""`fem`: linear elasticity with DOLFINx, the reference of every comparison."""

import time
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import ufl

from geometry.arrays import BoolArray, FloatArray
from geometry.errors import UserError
from solvers.elasticity import Lame, linear_energy_density
from solvers.fem.bridge import DistributedSpace, Factorisation
from solvers.fem.conditions import (
    held_components,
    load_functionals,
    patch_displacement,
    reaction_by_residual_work,
)
from solvers.fem.error_estimate import ErrorEstimator
from solvers.fem.lagrange import LagrangeField, LagrangeSpace
from solvers.fem.locking import locking_advice
from solvers.problem import Problem
from solvers.solution import ErrorEstimate, Solution, Status
from solvers.solver import Progress, check_problem, silent


@dataclass(frozen=True)
class FemSolver:
    """Lagrange elements of degree 1 or 2 on exactly the shared mesh, factorised by MUMPS.

    A `mean` or `point` load is one linear functional b_k per prescribed component: K x_k = b_k is solved once
    for each, and the forces f follow from (b_i . x_j) f_j = prescribed displacement. A `patch` is a Dirichlet
    condition.

    Attributes:
        degree: Degree of the elements, 1 or 2.
        estimate: Whether to estimate the discretisation error, at about half the cost of the solution.
    """

    degree: int = 2
    estimate: bool = True
    name: ClassVar[str] = "fem"
    laws: ClassVar[tuple[str, ...]] = ("linear",)
    loads: ClassVar[tuple[str, ...]] = ("mean", "point", "patch")

    def __post_init__(self) -> None:
        if self.degree not in (1, 2):
            raise UserError(f"fem has elements of degree 1 and 2, not {self.degree}")

    def settings(self) -> dict[str, object]:
        """The element degree, and whether the error is estimated."""
        return asdict(self)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve the linear problem; see `Solver`."""
        check_problem(self, problem)
        started = time.perf_counter()
        space = LagrangeSpace(problem.mesh, self.degree)
        system = LinearSystem.of(problem, space)
        progress(0.3, "assembled")
        least = LeastEnergy.of(system)
        nodal = least.solution()
        residual = system.residual(nodal)
        solved = time.perf_counter()
        progress(0.7, "solved")
        error = None
        if self.estimate and problem.load.kind != "point":
            error = ErrorEstimator(problem, space).estimate(nodal, lambda force: least.unbalanced(force)[1])
        least.factors.destroy()
        sentence = [
            "solved directly",
            _uncertainty(problem, error),
            locking_advice(self.degree, problem.material),
        ]
        return Solution(
            solver=self.name,
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
                "degree": self.degree,
            },
            error=error,
        )


def _uncertainty(problem: Problem, error: ErrorEstimate | None) -> str:
    """What is known of the discretisation error, in words."""
    if problem.load.kind == "point":
        return "a point load has no limit under refinement, so there is no error to estimate"
    if error is None:
        return "the discretisation is the only error, and was not estimated"
    return (
        f"the discretisation is the only error, an estimated {error.at_markers:.2g} mm at the markers "
        f"and {error.energy_norm:.2%} in the energy norm"
    )


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """The assembled stiffness with its boundary conditions."""

    problem: Problem
    distributed: DistributedSpace
    forms: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, problem: Problem, space: LagrangeSpace) -> "LinearSystem":
        """Compile the forms of a problem."""
        distributed = DistributedSpace(space)
        lame = problem.material.lame
        constants = Lame(distributed.constant(lame.λ), distributed.constant(lame.μ), lame.λ_out)
        u = distributed.function
        energy = linear_energy_density(ufl.grad(u), constants) * ufl.dx
        residual = ufl.derivative(energy, u, ufl.TestFunction(u.function_space))
        stiffness = ufl.derivative(residual, u, ufl.TrialFunction(u.function_space))
        forms = {"residual": distributed.form(residual), "stiffness": distributed.form(stiffness)}
        return cls(problem, distributed, forms)

    def factorise(self, clamped: BoolArray) -> Factorisation:
        """Assemble and factorise with the components of the mask `clamped`, shape (N, 2), held."""
        conditions = [
            condition
            for axis in (0, 1)
            for condition in self.distributed.clamp(np.flatnonzero(clamped[:, axis]), (axis,))
        ]
        matrix = self.distributed.assemble_matrix(self.forms["stiffness"], conditions)
        return Factorisation(self.distributed, matrix, clamped, positive_definite=True)

    def residual(self, nodal: FloatArray) -> FloatArray:
        """Internal force K u of nodal displacements, shape (N, 2), N/mm."""
        self.distributed.set_function(nodal)
        return self.distributed.assemble_nodal(self.forms["residual"])


@dataclass(frozen=True, eq=False)
class LeastEnergy:
    """Displacements of least energy for any values at base and contact, from one factorisation.

    Attributes:
        system: The stiffness.
        held: Nodal components whose values are given, mask of shape (N, 2).
        functionals: The load's functionals whose values are given, shape (k, N, 2); none for a `patch`.
        factors: Of the stiffness with the components of `held` clamped.
        responses: Displacement under the unit force of each functional, shape (k, N, 2), mm per N/mm.
    """

    system: LinearSystem
    held: BoolArray
    functionals: FloatArray
    factors: Factorisation
    responses: FloatArray

    @classmethod
    def of(cls, system: LinearSystem) -> "LeastEnergy":
        """Factorise, and solve once for each functional."""
        problem, space = system.problem, system.distributed.space
        held = held_components(problem, space)
        functionals = (
            np.zeros((0, *held.shape)) if problem.load.kind == "patch" else load_functionals(problem, space)
        )
        factors = system.factorise(held)
        responses = np.array([factors.solve(functional) for functional in functionals])
        return cls(system, held, functionals, factors, responses.reshape(functionals.shape))

    @cached_property
    def compliance(self) -> FloatArray:
        """Values of the functionals under their unit forces, shape (k, k), mm per N/mm."""
        return np.asarray(np.einsum("inx,jnx->ij", self.functionals, self.responses))

    def values(self, nodal: FloatArray) -> FloatArray:
        """The load's functionals of nodal displacements, shape (k,), mm."""
        return np.asarray(np.einsum("knx,nx->k", self.functionals, nodal))

    def solution(self) -> FloatArray:
        """The nodal displacements that solve the problem, shape (N, 2), mm."""
        problem, space = self.system.problem, self.system.distributed.space
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
            nodal = nodal + self.factors.solve(-self.system.residual(nodal))
        forces = np.linalg.solve(self.compliance, values - self.values(nodal))
        return np.asarray(nodal + np.einsum("k,knx->nx", forces, self.responses))

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

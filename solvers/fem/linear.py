"""`fem`: linear elasticity with DOLFINx, the reference of every comparison."""

import time
from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar

import numpy as np
import ufl

from geometry.arrays import BoolArray, FloatArray
from geometry.errors import UserError
from solvers.elasticity import Lame, linear_energy_density
from solvers.fem.bridge import DistributedSpace, Factorisation
from solvers.fem.lagrange import LagrangeField, LagrangeSpace
from solvers.problem import Problem, contact_functional
from solvers.solution import Solution, Status
from solvers.solver import Progress, check_problem, silent


@dataclass(frozen=True)
class FemSolver:
    """Lagrange elements of degree 1 or 2 on exactly the shared mesh, factorised by MUMPS.

    A `mean` or `point` load is one linear functional b_k per prescribed component: K x_k = b_k is solved once
    for each, and the forces f follow from (b_i . x_j) f_j = prescribed displacement. A `patch` is a Dirichlet
    condition.

    Attributes:
        degree: Degree of the elements, 1 or 2.
    """

    degree: int = 2
    name: ClassVar[str] = "fem"
    laws: ClassVar[tuple[str, ...]] = ("linear",)
    loads: ClassVar[tuple[str, ...]] = ("mean", "point", "patch")

    def __post_init__(self) -> None:
        if self.degree not in (1, 2):
            raise UserError(f"fem has elements of degree 1 and 2, not {self.degree}")

    def settings(self) -> dict[str, object]:
        """The element degree."""
        return asdict(self)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve the linear problem; see `Solver`."""
        check_problem(self, problem)
        started = time.perf_counter()
        space = LagrangeSpace(problem.mesh, self.degree)
        system = LinearSystem.of(problem, space)
        progress(0.3, "assembled")
        nodal = system.solve()
        residual = system.residual(nodal)
        return Solution(
            solver=self.name,
            problem=problem,
            field=LagrangeField(space, nodal),
            energy=0.5 * float((nodal * residual).sum()),
            reaction=reaction_by_residual_work(space, residual),
            status=Status(True, "solved directly; the discretisation is the only error"),
            stats={
                "seconds": time.perf_counter() - started,
                "unknowns": nodal.size,
                "triangles": len(problem.mesh.triangles),
                "degree": self.degree,
            },
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

    def solve(self) -> FloatArray:
        """Nodal displacements, shape (N, 2), mm."""
        space, load = self.distributed.space, self.problem.load
        clamped = held_components(self.problem, space)
        if load.kind == "patch":
            prescribed = patch_displacement(self.problem, space)
            factors = self.factorise(clamped)
            nodal = prescribed + factors.solve(-self.residual(prescribed))
        else:
            functionals = load_functionals(self.problem, space)
            factors = self.factorise(clamped)
            responses = [factors.solve(functional) for functional in functionals]
            compliance = np.array([[(b * x).sum() for x in responses] for b in functionals])
            forces = np.linalg.solve(compliance, load.values)
            nodal = np.asarray(np.einsum("k,knx->nx", forces, responses))
        factors.destroy()
        return nodal

    def residual(self, nodal: FloatArray) -> FloatArray:
        """Internal force K u of nodal displacements, shape (N, 2), N/mm."""
        self.distributed.set_function(nodal)
        return self.distributed.assemble_nodal(self.forms["residual"])


def held_components(problem: Problem, space: LagrangeSpace) -> BoolArray:
    """Nodal components that a Dirichlet condition prescribes, (N, 2): base and, for a `patch`, contact."""
    held = np.zeros((len(space.nodes), 2), dtype=bool)
    held[space.boundary_nodes("base")] = True
    if problem.load.kind == "patch":
        held[np.ix_(space.boundary_nodes("contact"), np.array(problem.load.prescribed))] = True
    return held


def patch_displacement(problem: Problem, space: LagrangeSpace) -> FloatArray:
    """Nodal displacements that are the load on the contact and zero elsewhere, shape (N, 2), mm."""
    values = np.zeros((len(space.nodes), 2))
    nodes = space.boundary_nodes("contact")
    values[np.ix_(nodes, np.array(problem.load.prescribed))] = problem.load.values
    return values


def load_functionals(problem: Problem, space: LagrangeSpace) -> FloatArray:
    """The load's functional on every shape function, one for each prescribed component, shape (k, N, 2)."""
    points, weights = contact_functional(problem)
    coefficients = space.shape_functions(problem.mesh.locate(points)).T @ weights
    functionals = np.zeros((len(problem.load.prescribed), len(space.nodes), 2))
    for row, axis in enumerate(problem.load.prescribed):
        functionals[row, :, axis] = coefficients
    return functionals


def reaction_by_residual_work(space: LagrangeSpace, residual: FloatArray) -> FloatArray:
    """Force of the indenter on the finger, shape (2,), N/mm: the work of the residual on a unit translation.

    The translation is one everywhere but at the base, where the clamp's own force works. Exact for the
    discrete solution, unlike an integral of stresses along the boundary.
    """
    moved = np.ones(len(space.nodes), dtype=bool)
    moved[space.boundary_nodes("base")] = False
    return np.asarray(residual[moved].sum(axis=0))

"""The discrete problem, linear or of finite strain: potential, forces, tangent and constraints.

With displacements c, multipliers f of the constraints, which may be springs of the compliance s_k, and the
potential Π of the elastic energy and, for a cylinder, of contact, equilibrium is

    dΠ/dc - f_k b_k = 0        b_k . c + s_k f_k = d_k
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
import ufl

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.solvers.constrained_elimination import ConstrainedElimination
from pinnray.solvers.contact.nodal_contact import ContactState, CylinderContact
from pinnray.solvers.elasticity import deformation_jacobian, energy_density_of
from pinnray.solvers.extrusion import NodalSpace
from pinnray.solvers.fem.boundary_conditions import DisplacementConstraints, dirichlet_conditions
from pinnray.solvers.fem.dolfinx_compat import DolfinxSpace
from pinnray.solvers.fem.factorisation import Factorisation
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.problem import Problem
from pinnray.solvers.shared_work import is_shared, shared
from pinnray.solvers.stability import ShiftedStep

QUADRATURE_DEGREE = 4
"""For laws of finite strain: exact for their quadratic part on quadratic elements."""

SHARED_UP_TO = 300_000
"""Unknowns up to which factors, half a GB there, are kept for the next solver."""


@dataclass(frozen=True, eq=False)
class LoadState(ContactState):
    """A state of the finger, in equilibrium or a guess; `contact` is empty without a cylinder."""

    forces: FloatArray  # Multipliers of the constraints, shape (k,), N/mm


class DiscreteEquilibrium:
    """The discrete problem; nodal arrays have the shape (N, d).

    `clamped` is the mask of components with a Dirichlet condition, and `prescribed` their displacement under
    the full load, mm; `elimination` solves with the constraints and the tangent factorised last, which is the
    stiffness for the linear law.
    """

    shared = False  # Whether other solvers use it too

    def __init__(
        self, problem: Problem, space: NodalSpace, constraints: DisplacementConstraints | None = None
    ) -> None:
        """Compile the forms; what needs factors first makes them. Constraints are the load's by default."""
        self.problem, self.linear = problem, problem.material.law == "linear"
        self.elements = DolfinxSpace(space)
        self.clamped, self.prescribed = dirichlet_conditions(problem, space)
        self.constraints = constraints or DisplacementConstraints.of(problem, space)
        self.contact = CylinderContact.of(problem, space) if problem.load.kind == "cylinder" else None
        material, gradient = problem.material, ufl.grad(self.elements.function)
        lame = material.solid_lame if self.elements.dimension == 3 else material.lame
        moduli = self.elements.moduli(lame)
        density = energy_density_of(material.law, gradient, moduli, ufl.ln)
        measure = ufl.dx if self.linear else ufl.dx(metadata={"quadrature_degree": QUADRATURE_DEGREE})
        self._integrand = density / space.thickness * measure
        self._inside_out = ufl.conditional(ufl.gt(deformation_jacobian(gradient), 0), 0.0, 1.0) * measure
        self._force, self.tangent = self.elements.derivatives(self._integrand)
        self.factors = self.factorised(self.clamped)
        self._eliminated: ConstrainedElimination | None = None

    @cached_property
    def _energy(self) -> Any:
        return self.elements.form(self._integrand)

    @cached_property
    def _inverted(self) -> Any:
        return self.elements.form(self._inside_out)

    def factorised(self, clamped: BoolArray) -> Factorisation:
        """Factors of the tangent at the displacements set last, with a mask of clamped components, (N, d)."""
        self._conditions = self.elements.clamp(clamped)
        self.matrix = self.elements.assemble_matrix(self.tangent, self._conditions)
        return Factorisation(self.elements, self.matrix, clamped, positive_definite=self.linear)

    def prescribe(self, problem: Problem) -> None:
        """Take another load of a body of linear law; keeps the factors and responses that still hold."""
        if problem.load == self.problem.load:
            return
        space, functionals = self.elements.space, self.constraints.functionals
        clamped, self.prescribed = dirichlet_conditions(problem, space)
        self.problem, self.constraints = problem, DisplacementConstraints.of(problem, space)
        if not np.array_equal(clamped, self.clamped):
            self.factors.destroy()
            self.clamped, self.factors = clamped, self.factorised(clamped)
        elif np.array_equal(functionals, self.constraints.functionals):
            return
        self._eliminated = None

    def energy(self, nodal: FloatArray) -> float:
        """Elastic energy per depth, N mm / mm."""
        self.elements.set_function(nodal)
        return self.elements.assemble_scalar(self._energy)

    def internal_force(self, nodal: FloatArray) -> FloatArray:
        """Derivative of the elastic energy, shape (N, d), N/mm."""
        self.elements.set_function(nodal)
        return self.elements.assemble_nodal(self._force)

    def _stiff(self, nodal: FloatArray) -> FloatArray:
        """Stiffness at rest times displacements, shape (N, d), N/mm."""
        if self.linear:
            return self.internal_force(nodal)
        step = 1e-4
        return (self.internal_force(step * nodal) - self.internal_force(-step * nodal)) / (2 * step)

    def residual(self, state: LoadState) -> tuple[FloatArray, float]:
        """Residual force, shape (N, d), N/mm, zero where clamped, and the largest internal force."""
        internal = self.internal_force(state.nodal)
        balance = internal - self.constraints.at_nodes(state.forces)
        if self.contact is not None:
            pressing = self.contact.gradient(state)
            balance[self.contact.nodes, : pressing.shape[1]] += pressing
        return np.where(self.clamped, 0.0, balance), float(np.abs(internal).max())

    def factorise(self, state: LoadState, shift: float = 0.0) -> None:
        """Factorise the tangent at a state, with a shift of its diagonal, N/mm per mm."""
        self.elements.set_function(state.nodal)
        self.elements.assemble_matrix(self.tangent, self._conditions, into=self.matrix)
        if self.contact is not None:
            free = ~self.clamped[self.contact.nodes]
            inner = self.contact.tangent(state)
            blocks = np.pad(inner, ((0, 0), *2 * ((0, self.elements.dimension - inner.shape[1]),)))
            blocks *= free[:, :, None] & free[:, None, :]
            self.elements.add_blocks(self.matrix, self.contact.nodes, blocks)
        if shift:
            self.matrix.shift(shift)
        self.factors.update()
        self._eliminated = None

    @property
    def elimination(self) -> ConstrainedElimination:
        """The constraints' forces and the nodes' displacements by the factors at hand."""
        if self._eliminated is None:
            rows, slacks = self.constraints.functionals, self.constraints.slacks
            self._eliminated = ConstrainedElimination(rows, self.factors.solve_all(rows), slacks)
        return self._eliminated

    def response(self, force: FloatArray) -> FloatArray:
        """Displacements, mm, under nodal forces, N/mm, by the factorised tangent: both (N, d)."""
        return self.elimination.solution(self.factors.solve(force))[0]

    def responses(self, forces: FloatArray) -> FloatArray:
        """Responses to several at once, shape (r, N, d)."""
        return np.array([self.elimination.solution(free)[0] for free in self.factors.solve_all(forces)])

    def minimiser(self, given: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Displacements (N, d), mm, of least energy by the tangent at rest, which must be factorised.

        Args:
            given: Displacements whose clamped components are taken, shape (N, d), mm.
            values: Of the constraints, shape (k,), mm. Their forces, N/mm, are returned, too.
        """
        nodal = np.where(self.clamped, given, 0.0)
        if nodal.any():
            nodal = nodal + self.factors.solve(-self._stiff(nodal))
        return self.elimination.solution(nodal, values)

    @property
    def unstable(self) -> int:
        """Number of directions in which the energy falls at the state factorised last."""
        return self.elimination.unstable(self.factors.negative)

    def softest(self) -> FloatArray:
        """Direction of least stiffness at the state factorised last, largest component one, (N, d).

        By inverse iteration, which keeps the constraints.
        """
        direction = np.random.default_rng(0).standard_normal(self.clamped.shape)
        for _ in range(3):  # enough to leave soft directions of an unstable equilibrium, not only the softest
            direction = self.response(np.where(self.clamped, 0.0, direction))
            direction /= np.abs(direction).max()
        return direction

    def step_at(self, about: LoadState) -> Callable[[FloatArray, float], ShiftedStep | None]:
        """Newton's step, under the load of a state, by displacements and a shift over Young's modulus."""

        def step(nodal: FloatArray, shift: float) -> ShiftedStep | None:
            self.factorise(replace(about, nodal=nodal), shift * self.problem.material.young)
            force = np.where(self.clamped, 0.0, -self.internal_force(nodal))
            gaps = about.fraction * self.constraints.targets - self.constraints.values(nodal)
            change, _ = self.elimination.solution(self.factors.solve(force), gaps)
            return ShiftedStep(change, self.unstable)

        return step

    def energy_with_springs(self, about: LoadState) -> Callable[[FloatArray], float]:
        """Energy per depth, springs included, under the load of a state; infinite if inadmissible."""
        soft = self.constraints.slacks > 0

        def energy(nodal: FloatArray) -> float:
            if not self.admissible(nodal):
                return np.inf
            gaps = about.fraction * self.constraints.targets - self.constraints.values(nodal)
            return self.energy(nodal) + 0.5 * float((gaps[soft] ** 2 / self.constraints.slacks[soft]).sum())

        return energy

    def admissible(self, nodal: FloatArray) -> bool:
        """Whether the deformation turns no quadrature point inside out."""
        if not np.isfinite(nodal).all():
            return False
        self.elements.set_function(nodal)
        return self.elements.assemble_scalar(self._inverted) == 0

    @property
    def rest(self) -> LoadState:
        """The state without load."""
        contact = 0 if self.contact is None else len(self.contact.nodes)
        forces = np.zeros(len(self.constraints.targets))
        rest = LoadState(0.0, np.zeros(self.clamped.shape), np.zeros(contact), forces)
        return rest if self.contact is None else replace(rest, friction=self.contact.started(rest))

    def linear_guess(self, fraction: float) -> LoadState:
        """The linear solution at a fraction of the load, by `minimiser`.

        A cylinder touches only the node nearest to it, and the nodes above it along z.
        """
        if self.contact is not None:
            return self._pressed_at_one_node(self.contact, fraction)
        nodal, forces = self.minimiser(self.prescribed, self.constraints.targets)
        return LoadState(fraction, fraction * nodal, np.zeros(0), fraction * forces)

    def _pressed_at_one_node(self, contact: CylinderContact, fraction: float) -> LoadState:
        rest = replace(self.rest, fraction=fraction)
        gap, normal = contact.gaps(rest)
        nearest = gap.argmin()
        line = np.arange(nearest % len(contact.positions), len(gap), len(contact.positions))
        functional = np.zeros((1, *self.clamped.shape))
        functional[0, contact.nodes[line], :2] = contact.shares[:, None] * normal[nearest]
        pressing = ConstrainedElimination(functional, self.factors.solve_all(functional))
        nodal, force = pressing.solution(rest.nodal, np.maximum(-gap[[nearest]], 0.0))
        rest.contact[line] = force[0] * contact.shares
        return replace(rest, nodal=nodal)


def linear_equilibrium(problem: Problem, degree: int) -> DiscreteEquilibrium:
    """The discrete problem of a linear law on plane elements, made and factorised once where work is shared.

    Under a mean or point load the factors are those of the body with its base clamped.
    """
    space = LagrangeSpace(problem.mesh, degree)

    made = partial(DiscreteEquilibrium, problem, space)
    small = space.nodes.size <= SHARED_UP_TO and problem.load.kind in ("mean", "point")
    if not (small and is_shared()):
        return made()
    key = ("equilibrium", problem.mesh.digest, repr(problem.material), degree)
    found = shared(key, made)
    found.shared = True
    found.prescribe(problem)
    return found

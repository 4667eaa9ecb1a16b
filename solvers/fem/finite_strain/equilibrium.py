"""The discrete finite-strain problem: potential, forces, tangent and constraints.

With displacements c, multipliers f of the constraints, which may be springs of the compliance s_k, and the
potential Π of the elastic energy and, for a cylinder, of contact, equilibrium is

    dΠ/dc - f_k b_k = 0        b_k . c + s_k f_k = d_k
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import ufl

from geometry.arrays import BoolArray, FloatArray
from solvers.assimilation.misfit import Misfit
from solvers.constrained_elimination import ConstrainedElimination
from solvers.cylinder_contact import ContactState, CylinderContact
from solvers.elasticity import deformation_jacobian, energy_density_of
from solvers.extrusion import NodalSpace
from solvers.fem.boundary_conditions import (
    dirichlet_displacement,
    dirichlet_mask,
    load_functionals,
    load_targets,
    marker_functionals,
)
from solvers.fem.dolfinx_compat import DistributedSpace
from solvers.fem.linear_solvers import Factorisation, Multigrid
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem
from solvers.stability import ShiftedStep

QUADRATURE_DEGREE = 4
"""Exact for the quadratic part of the law on quadratic elements."""


@dataclass(frozen=True, eq=False)
class LoadState(ContactState):
    """A state of the finger, in equilibrium or a guess; `contact` is empty without a cylinder."""

    forces: FloatArray  # Multipliers of the constraints, shape (k,), N/mm


@dataclass(frozen=True, eq=False)
class DisplacementConstraints:
    """Constraints b_k . c + s_k f_k = d_k on the displacements c, with forces f_k."""

    functionals: FloatArray  # b_k, shape (k, N, d)
    targets: FloatArray  # d_k under the full load, shape (k,), mm
    # s_k, shape (k,), mm per N/mm: zero where the value is prescribed, else the compliance of a spring with
    # the energy (d_k - b_k . c)^2 / (2 s_k)
    slacks: FloatArray

    @classmethod
    def of(cls, problem: Problem, space: NodalSpace, slack: float = 0.0) -> "DisplacementConstraints":
        """The constraints of a `mean` or `point` load, all of one slack; else none."""
        targets = load_targets(problem)
        return cls(load_functionals(problem, space), targets, np.full(len(targets), slack))

    @classmethod
    def springs(cls, misfit: Misfit, space: LagrangeSpace) -> "DisplacementConstraints":
        """Springs between markers and observed positions, whose energy is the misfit; u v u v ..."""
        return cls(marker_functionals(misfit, space), misfit.observed.ravel(), 1 / misfit.weights.ravel())

    def joined(self, other: "DisplacementConstraints") -> "DisplacementConstraints":
        """Both, in this order."""
        return DisplacementConstraints(
            np.concatenate([self.functionals, other.functionals]),
            np.concatenate([self.targets, other.targets]),
            np.concatenate([self.slacks, other.slacks]),
        )

    def only(self, kept: BoolArray) -> "DisplacementConstraints":
        """Subset selected by a mask of shape (k,)."""
        return DisplacementConstraints(self.functionals[kept], self.targets[kept], self.slacks[kept])

    def values(self, nodal: FloatArray) -> FloatArray:
        """b_k . c of displacements of shape (N, d), mm: shape (k,)."""
        return np.asarray(np.einsum("knx,nx->k", self.functionals, nodal))

    def at_nodes(self, forces: FloatArray) -> FloatArray:
        """f_k b_k of forces of shape (k,), N/mm: shape (N, d)."""
        return np.asarray(np.einsum("k,knx->nx", forces, self.functionals))

    def residual(self, nodal: FloatArray, forces: FloatArray, fraction: float) -> FloatArray:
        """Residual of the constraints at a fraction of the load, shape (k,), mm."""
        return np.asarray(fraction * self.targets - self.values(nodal) - self.slacks * forces)


class FiniteStrainEquilibrium:
    """The discrete problem; nodal arrays of shape (N, d) are the same on every rank.

    `clamped` is the mask of components with a Dirichlet condition, and `prescribed` their displacement under
    the full load, mm; `elimination` solves with the constraints and the tangent factorised last.
    """

    def __init__(
        self,
        problem: Problem,
        space: NodalSpace,
        constraints: DisplacementConstraints | None = None,
        *,
        iterative: bool = False,
    ) -> None:
        """Compile the forms; without constraints they are the load's."""
        self.distributed = DistributedSpace(space)
        self.clamped: BoolArray = dirichlet_mask(problem, space)
        self.prescribed = dirichlet_displacement(problem, space)
        self.constraints = constraints or DisplacementConstraints.of(problem, space)
        self.contact = CylinderContact.of(problem, space) if problem.load.kind == "cylinder" else None
        self._young = problem.material.young
        material, gradient = problem.material, ufl.grad(self.distributed.function)
        lame = material.solid_lame if self.distributed.dimension == 3 else material.lame
        density = energy_density_of(material.law, gradient, self.distributed.moduli(lame), ufl.ln)
        measure = ufl.dx(metadata={"quadrature_degree": QUADRATURE_DEGREE})
        energy = density / space.thickness * measure
        self._energy = self.distributed.form(energy)
        inverted = ufl.conditional(ufl.gt(deformation_jacobian(gradient), 0), 0.0, 1.0)
        self._inverted = self.distributed.form(inverted * measure)
        self._force, self._tangent = self.distributed.derivatives(energy)
        self._conditions = self.distributed.clamp(self.clamped)
        self.matrix = self.distributed.assemble_matrix(self._tangent, self._conditions)
        system = self.distributed, self.matrix, self.clamped
        self.factors: Factorisation | Multigrid
        if not iterative:
            self.factors = Factorisation(*system, positive_definite=False)
        elif material.law == "linear":
            self.factors = Multigrid(*system)
        else:  # What a step of Newton's method leaves, the next one takes.
            self.factors = Multigrid(*system, tolerance=1e-4, tangent=True)
        self.elimination = self._elimination()

    def energy(self, nodal: FloatArray) -> float:
        """Elastic energy per depth, N mm / mm."""
        self.distributed.set_function(nodal)
        return self.distributed.assemble_scalar(self._energy)

    def internal_force(self, nodal: FloatArray) -> FloatArray:
        """Derivative of the elastic energy, shape (N, d), N/mm."""
        self.distributed.set_function(nodal)
        return self.distributed.assemble_nodal(self._force)

    def residual(self, state: LoadState) -> tuple[FloatArray, float]:
        """Residual force, shape (N, d), N/mm, zero where clamped, and the largest internal force."""
        internal = self.internal_force(state.nodal)
        balance = internal - self.constraints.at_nodes(state.forces)
        if self.contact is not None:
            balance[self.contact.nodes, :2] += self.contact.gradient(state)
        return np.where(self.clamped, 0.0, balance), float(np.abs(internal).max())

    def factorise(self, state: LoadState, shift: float = 0.0) -> None:
        """Factorise the tangent at a state, with a shift of its diagonal, N/mm per mm."""
        self.distributed.set_function(state.nodal)
        self.distributed.assemble_matrix(self._tangent, self._conditions, into=self.matrix)
        if self.contact is not None:
            free = ~self.clamped[self.contact.nodes]
            inner = self.contact.tangent(state)
            blocks = np.pad(inner, ((0, 0), *2 * ((0, self.distributed.dimension - 2),)))
            blocks *= free[:, :, None] & free[:, None, :]
            self.distributed.add_blocks(self.matrix, self.contact.nodes, blocks)
        if shift:
            self.matrix.shift(shift)
        self.factors.update(state.nodal)
        self.elimination = self._elimination()

    def _elimination(self) -> ConstrainedElimination:
        rows, slacks = self.constraints.functionals, self.constraints.slacks
        return ConstrainedElimination(rows, self.factors.solve_all(rows), slacks)

    def response(self, force: FloatArray) -> FloatArray:
        """Displacements, mm, under nodal forces, N/mm, by the factorised tangent: both (N, d)."""
        return self.elimination.solution(self.factors.solve(force))[0]

    @property
    def unstable(self) -> int | None:
        """Number of directions in which the energy falls at the state factorised last; None if iterated."""
        if not isinstance(self.factors, Factorisation):
            return None
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
        """Newton's step at displacements, the load that of a state, and a shift over Young's modulus."""

        def step(nodal: FloatArray, shift: float) -> ShiftedStep | None:
            self.factorise(replace(about, nodal=nodal), shift * self._young)
            force = np.where(self.clamped, 0.0, -self.internal_force(nodal))
            gaps = about.fraction * self.constraints.targets - self.constraints.values(nodal)
            change, _ = self.elimination.solution(self.factors.solve(force), gaps)
            return ShiftedStep(change, self.unstable or 0)

        return step

    def energy_with_springs(self, about: LoadState) -> Callable[[FloatArray], float]:
        """Energy per depth, with that of springs, under the load of a state; infinite if inadmissible."""
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
        self.distributed.set_function(nodal)
        return self.distributed.assemble_scalar(self._inverted) == 0

    @property
    def rest(self) -> LoadState:
        """The state without load."""
        contact = 0 if self.contact is None else len(self.contact.nodes)
        forces = np.zeros(len(self.constraints.targets))
        return LoadState(0.0, np.zeros(self.clamped.shape), np.zeros(contact), forces)

    def linear_guess(self, fraction: float) -> LoadState:
        """The linear solution at a fraction of the load, by the undeformed tangent, which must be factorised.

        A cylinder touches only the node nearest to it, and the nodes above it along z.
        """
        if self.contact is not None:
            return self._pressed_at_one_node(self.contact, fraction)
        nodal = fraction * self.prescribed
        if nodal.any():
            probe = 1e-4  # fraction of the load in the finite difference of the internal forces at rest
            step = probe * self.prescribed
            stiffness = (self.internal_force(step) - self.internal_force(-step)) / (2 * probe)
            nodal = nodal + self.factors.solve(-fraction * stiffness)
        nodal, forces = self.elimination.solution(nodal, fraction * self.constraints.targets)
        return LoadState(fraction, nodal, np.zeros(0), forces)

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

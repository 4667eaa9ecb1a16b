"""The finite-strain problem at one stage of its load: potential, forces, tangent and constraints.

With displacements c, multipliers f of the constraints, which may be springs of the compliance s_k, and the
potential Π of the elastic energy and, for a cylinder, of contact, equilibrium is

    dΠ/dc - f_k b_k = 0        b_k . c + s_k f_k = d_k
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl

from geometry.arrays import BoolArray, FloatArray
from geometry.mesh.quadrature import body_quadrature
from solvers.constrained_elimination import ConstrainedElimination
from solvers.elasticity import Lame, deformation_jacobian, energy_density_of
from solvers.fem.boundary_conditions import held_components, held_displacement
from solvers.fem.dolfinx_compat import DistributedSpace, Factorisation
from solvers.fem.finite_strain.constraints import DisplacementConstraints
from solvers.fem.finite_strain.cylinder_contact import CylinderContact
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem

QUADRATURE_DEGREE = 4
"""Of the energy's integral: exact for quadratic elements with the quadratic part of the law."""
PROBE = 1e-4
"""Fraction of the load in the difference that stands for a derivative of the internal forces at rest."""


@dataclass(frozen=True, eq=False)
class LoadStage:
    """What is given at one stage of the load.

    Attributes:
        fraction: Of the load.
        multipliers: Of the contact, shape (m,), N/mm; empty without one.
    """

    fraction: float
    multipliers: FloatArray


class FiniteStrainEquilibrium:
    """The discrete problem; nodal arrays of shape (N, 2) are the same on every rank.

    Attributes:
        distributed: The elements in DOLFINx.
        clamped: Components that a Dirichlet condition holds, mask of shape (N, 2).
        held: Their displacement under the full load, shape (N, 2), mm.
        constraints: What holds functionals of the displacements.
        elimination: Of the constraints, by the tangent that was factorised last.
        contact: The cylinder, if there is one.
    """

    def __init__(
        self, problem: Problem, space: LagrangeSpace, constraints: DisplacementConstraints | None = None
    ) -> None:
        """Compile the forms; the constraints are the load's unless others are given."""
        self.distributed = DistributedSpace(space)
        self.clamped: BoolArray = held_components(problem, space)
        self.held = held_displacement(problem, space)
        self.constraints = constraints or DisplacementConstraints.of(problem, space)
        self.contact = CylinderContact.of(problem, space) if problem.load.kind == "cylinder" else None
        self._derivatives = space.shape_gradients(body_quadrature(problem.mesh, QUADRATURE_DEGREE).location)
        lame = problem.material.lame
        constants = Lame(self.distributed.constant(lame.λ), self.distributed.constant(lame.μ), lame.λ_out)
        self._moduli: tuple[Any, Any] = constants[:2]
        u = self.distributed.function
        measure = ufl.dx(metadata={"quadrature_degree": QUADRATURE_DEGREE})
        energy = energy_density_of(problem.material.law, ufl.grad(u), constants, ufl.ln) * measure
        residual = ufl.derivative(energy, u, ufl.TestFunction(u.function_space))
        tangent = ufl.derivative(residual, u, ufl.TrialFunction(u.function_space))
        self._energy, self._residual, self._tangent = map(self.distributed.form, (energy, residual, tangent))
        self._conditions = [
            condition
            for axis in (0, 1)
            for condition in self.distributed.clamp(np.flatnonzero(self.clamped[:, axis]), (axis,))
        ]
        matrix = self.distributed.assemble_matrix(self._tangent, self._conditions)
        self.matrix = matrix
        self.factors = Factorisation(self.distributed, matrix, self.clamped, positive_definite=False)
        self.elimination = self._elimination()

    def become(self, problem: Problem) -> None:
        """Take another `mean` or `point` load, with the same components prescribed, and other moduli."""
        self.constraints = DisplacementConstraints.of(problem, self.distributed.space)
        self._set_moduli(problem.material.lame)

    def force_slope(self, nodal: FloatArray, moduli: Lame, slopes: Lame) -> FloatArray:
        """Derivative of the internal force, which is linear in λ and μ, along a change of them, (N, 2), N/mm.

        Args:
            nodal: Displacements, shape (N, 2), mm.
            moduli: What λ and μ are, MPa.
            slopes: How they change.
        """
        self._set_moduli(slopes)
        force = self.internal_force(nodal)
        self._set_moduli(moduli)
        return force

    def _set_moduli(self, lame: Lame) -> None:
        for constant, value in zip(self._moduli, lame[:2], strict=True):
            constant.value = value

    def energy(self, nodal: FloatArray) -> float:
        """Elastic energy per depth, N mm / mm."""
        self.distributed.set_function(nodal)
        return self.distributed.assemble_scalar(self._energy)

    def internal_force(self, nodal: FloatArray) -> FloatArray:
        """Derivative of the elastic energy, shape (N, 2), N/mm."""
        self.distributed.set_function(nodal)
        return self.distributed.assemble_nodal(self._residual)

    def unbalanced(self, nodal: FloatArray, forces: FloatArray, stage: LoadStage) -> tuple[FloatArray, float]:
        """What is left of equilibrium, shape (N, 2), N/mm, zero where clamped; the largest internal force.

        Args:
            nodal: Displacements, shape (N, 2), mm.
            forces: Multipliers of the constraints, shape (k,), N/mm.
            stage: Of the load.
        """
        internal = self.internal_force(nodal)
        balance = internal - self.constraints.at_nodes(forces)
        if self.contact is not None:
            balance[self.contact.nodes] += self.contact.gradient(nodal, stage.fraction, stage.multipliers)
        return np.where(self.clamped, 0.0, balance), float(np.abs(internal).max())

    def factorise(self, nodal: FloatArray, stage: LoadStage) -> None:
        """Factorise the tangent at displacements of shape (N, 2), mm."""
        self.distributed.set_function(nodal)
        self.distributed.assemble_matrix(self._tangent, self._conditions, into=self.matrix)
        if self.contact is not None:
            nodes = self.contact.nodes
            blocks = self.contact.tangent(nodal, stage.fraction, stage.multipliers)
            free = ~self.clamped[nodes]
            self.distributed.add_blocks(self.matrix, nodes, blocks * (free[:, :, None] & free[:, None, :]))
        self.factors.update()
        self.elimination = self._elimination()

    def _elimination(self) -> ConstrainedElimination:
        """Of the constraints, by the tangent that is factorised."""
        return ConstrainedElimination.of(
            self.factors.solve, self.constraints.functionals, self.constraints.slacks
        )

    def response(self, force: FloatArray) -> FloatArray:
        """Change of the displacements under more nodal forces, by the tangent that is factorised, (N, 2), mm.

        Args:
            force: Shape (N, 2), N/mm.
        """
        return self.elimination.solution(self.factors.solve(force))[0]

    def possible(self, nodal: FloatArray) -> bool:
        """Whether the deformation turns no quadrature point inside out."""
        gradient = np.stack([derivative @ nodal for derivative in self._derivatives], axis=-1)
        return bool(np.isfinite(nodal).all() and (deformation_jacobian(gradient) > 0).all())

    def linear_guess(self, fraction: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Where the undeformed tangent, which must be factorised, leads at a fraction of the load.

        For a cylinder that is as if it touched only the node that it has come nearest to.

        Returns:
            Displacements, shape (N, 2), mm, that meet the constraints; multipliers of the constraints, shape
            (k,), and of the contact, shape (m,), N/mm.
        """
        nodal = fraction * self.held
        if nodal.any():
            step = PROBE * self.held
            stiffness = (self.internal_force(step) - self.internal_force(-step)) / (2 * PROBE)
            nodal = nodal + self.factors.solve(-fraction * stiffness)
        if self.contact is not None:
            return self._pressed_at_one_node(self.contact, fraction)
        return *self.elimination.solution(nodal, fraction * self.constraints.targets), np.zeros(0)

    def _pressed_at_one_node(
        self, contact: CylinderContact, fraction: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        rest = np.zeros(self.clamped.shape)
        gap, normal = contact.gaps(rest, fraction)
        nearest = gap.argmin()
        functional = rest.copy()
        functional[contact.nodes[nearest]] = normal[nearest]
        pressing = ConstrainedElimination.of(self.factors.solve, functional[None])
        nodal, force = pressing.solution(rest, np.maximum(-gap[[nearest]], 0.0))
        pressed = np.zeros(len(gap))
        pressed[nearest] = force[0]
        return nodal, np.zeros(0), pressed

"""A rigid cylinder pressed on a finite-basis network at finite strain, by an augmented Lagrangian.

The gaps are collocated at the nodes of quadratic elements on the front face: `solvers.contact`. A
node that touches is a pair of springs of the linearised network: along the normal, of the compliance 1 / k,
and along the cylinder, of the negative compliance -(g + radius) / q, as the force q turns with the normal.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import torch
from scipy.sparse import csr_matrix

from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.solvers.constrained_elimination import ConstrainedElimination
from pinnray.solvers.contact.contact_region import ContactRegion
from pinnray.solvers.contact.nodal_contact import ContactState, CylinderContact
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.pinn.finite_basis.constrained_network import ConstrainedNetwork, NewtonIterate
from pinnray.solvers.pinn.finite_basis.energy import REGULARISATION
from pinnray.solvers.pinn.finite_basis.newton import Level, LoadStep, follow_load
from pinnray.solvers.problem import Problem
from pinnray.solvers.solver import Progress
from pinnray.solvers.symmetric_factors import Factors

STIFF, SOFT = 10.0, 0.3
"""k over Young's modulus, and the same with which the forces of a coarser network are taken over."""
PENETRATION, LOOSE, STALLED = 5e-4, 5e-3, 0.9
"""Largest gap of a node in contact and penetration of any node, mm.

The windows of a level may be too wide to bring all of these nodes onto the cylinder: their forces would drift
apart for ever. A gap below LOOSE that is more than STALLED of the one before new multipliers will do.
"""
EXACT, ROUGH = 1e-6, 1e-2
"""Newton stops when a step changes this part of the energy, in equilibrium and on the way to it."""
ITERATIONS, UPDATES = 20, 20
"""Newton iterations with the same multipliers, and their updates, before a load step counts as failed."""
NEAR = 2e-3
"""Size of a Newton step below which the tangent before will do, if the step can be taken as a whole."""
ROUNDING = 1e-12
"""The same below which the potential may rise by rounding."""
SHORTEST = 2.0**-9
"""Shortest share of a Newton step that is tried; of one by an older tangent it is the whole."""


class Tangent(NamedTuple):
    """The factorised second derivative of the elastic energy, kept while Newton's steps with it converge."""

    output: torch.Tensor  # The output layer at which it was formed
    factors: Factors  # Of the network's tangent, without the cylinder


class Step(NamedTuple):
    """A Newton step."""

    change: torch.Tensor  # Of the output layer, of its shape, mm
    size: float  # Work of the imbalance on the change over the energy: small where Newton has converged
    unstable: int  # Number of directions in which the potential falls where the tangent was formed


class Taken(NamedTuple):
    """A part of a step."""

    step: Step  # The step
    output: torch.Tensor  # The output layer after it
    potential: float  # There
    length: float  # The part, 0 if the potential does not fall


class Minimum(NamedTuple):
    """The least potential with given multipliers."""

    output: torch.Tensor  # Where it is found
    step: Step  # The last step
    tangent: Tangent  # The last one, for what comes next


@dataclass(frozen=True, eq=False)
class PressedNetwork:
    """A network without other loads, and the cylinder."""

    network: ConstrainedNetwork  # The network
    contact: CylinderContact  # The cylinder and the m nodes of the front
    values: csr_matrix  # The basis functions at these nodes, shape (m, c (m + 1))
    count: int  # Number of nodes of the section's quadratic elements

    @classmethod
    def of(cls, network: ConstrainedNetwork, problem: Problem) -> "PressedNetwork":
        """The network of a problem whose load is a `cylinder`."""
        space = LagrangeSpace(problem.mesh, 2)
        contact = CylinderContact.of(problem, space)
        contact = replace(contact, stiffness=STIFF * problem.material.young)
        points = contact.positions
        values = network.energy.basis.functionals(points, np.eye(len(points)))
        values = csr_matrix(values.reshape(len(points), -1))
        return cls(network, contact, values, len(space.nodes))

    def equilibrium(self, coarse: Level | None, progress: Progress) -> LoadStep:
        """Equilibrium from that of a coarser network or, if that fails, along the load."""
        found = self.refined(coarse) if coarse is not None and coarse.reached.fraction == 1 else None
        return self.followed(progress) if found is None else found

    def refined(self, coarse: Level) -> LoadStep | None:
        """Equilibrium under the full load from that of a coarser network; None if it is not found."""
        near, forces = self.network.energy.nearest(coarse.field), coarse.reached.state.forces
        if near is None:
            return None
        tangent = Tangent(*near)
        gently = replace(self.contact, stiffness=SOFT / STIFF * self.contact.stiffness)
        soft = replace(self, contact=gently)
        found, first = soft._minimum(tangent.output, 1.0, forces, ROUGH, tangent)
        if found is None:
            return None
        forces = gently.forces(soft.stage(found.output, 1.0, forces))
        held = self._held(found.output, 1.0, forces, found.tangent)
        start = min((found.output, held), key=lambda each: self._potential(each, 1.0, forces))
        state, iterations = self._in_balance(start, 1.0, forces, found.tangent)
        return None if state is None else self._load_step(1.0, state, first + iterations)

    def followed(self, progress: Progress) -> LoadStep:
        """Equilibrium along the load; the last one before the full load if one is not found."""

        def reach(guess: NewtonIterate, fraction: float) -> tuple[NewtonIterate | None, int]:
            output, forces = guess.output, guess.forces
            if not output.any():
                output, forces = self._pressed_at_one_node(fraction)
            return self._in_balance(output, fraction, forces)

        rest = NewtonIterate(self.network.zero_output, np.zeros(len(self.contact.positions)), 0.0)
        longest = self.contact.longest_step
        found = follow_load(rest, reach, progress, longest=longest, quick=np.inf)
        return self._load_step(found.fraction, found.state, found.iterations)

    def stage(self, output: torch.Tensor, fraction: float, multipliers: FloatArray) -> ContactState:
        """The contact at an output layer."""
        nodal = np.zeros((self.count, 2))
        nodal[self.contact.nodes] = self.values @ output.permute(0, 2, 1).reshape(-1, 2).numpy()
        return ContactState(fraction, nodal, multipliers)

    def _load_step(self, fraction: float, state: NewtonIterate, iterations: int) -> LoadStep:
        stage = self.stage(state.output, fraction, state.forces)
        return LoadStep(fraction, state, iterations, ContactRegion.of(self.contact, stage))

    def _in_balance(
        self, output: torch.Tensor, fraction: float, multipliers: FloatArray, tangent: Tangent | None = None
    ) -> tuple[NewtonIterate | None, int]:
        """Equilibrium from a guess, None if the iteration fails, and the Newton iterations taken.

        Without a tangent near the guess one is formed there, and takes the guess to the nodes with forces.
        """
        iterations, before = 0, np.inf
        if tangent is None:
            tangent, iterations = self._tangent(output), 1
            if tangent is None:
                return None, iterations
            output = self._held(output, fraction, multipliers, tangent)
        for _ in range(UPDATES):
            tolerance = EXACT if fraction == 1 else ROUGH
            found, taken = self._minimum(output, fraction, multipliers, tolerance, tangent)
            iterations += taken
            if found is None:
                return None, iterations
            output, step, tangent = found
            stage = self.stage(output, fraction, multipliers)
            forces = self.contact.forces(stage)
            gap, _ = self.contact.gaps(stage)
            apart = max(np.abs(gap[forces > 0]).max(initial=0.0), -gap.min())
            if fraction < 1:  # on the way a soft contact will do
                return NewtonIterate(output, forces, step.size), iterations
            near = apart <= PENETRATION or STALLED * before < apart <= LOOSE
            if near and (state := self._settled(output, multipliers)) is not None:
                return state, iterations + 1
            multipliers, before = forces, apart
        return None, iterations

    def _settled(self, output: torch.Tensor, multipliers: FloatArray) -> NewtonIterate | None:
        """Equilibrium under the full load after a last step by the tangent there, which tells stability."""
        stage = self.stage(output, 1.0, multipliers)
        touching = np.flatnonzero(self.contact.forces(stage) > 0)
        tangent = self._tangent(output)
        step = None if tangent is None else self._step(stage, output, touching, tangent)
        if step is None or step.size > EXACT:
            return None
        output = output + step.change
        forces = self.contact.forces(self.stage(output, 1.0, multipliers))
        return NewtonIterate(output, forces, step.size, unstable=step.unstable)

    def _held(
        self, output: torch.Tensor, fraction: float, multipliers: FloatArray, tangent: Tangent
    ) -> torch.Tensor:
        """A guess after a step in which the nodes with forces stay in touch, as far as it can be taken."""
        touching = np.flatnonzero(multipliers > 0)
        if not len(touching):
            return output
        step = self._step(self.stage(output, fraction, multipliers), output, touching, tangent)
        length = 1.0
        while step is not None and length >= SHORTEST:
            if np.isfinite(self.network.energy.total(moved := output + length * step.change)):
                return moved
            length /= 2
        return output

    def _minimum(
        self, output: torch.Tensor, fraction: float, multipliers: FloatArray, largest: float, tangent: Tangent
    ) -> tuple[Minimum | None, int]:
        """The least potential with given multipliers, by Newton's method with a line search.

        Near the minimum the tangent before is kept: see `NEAR`.
        """
        least = self._potential(output, fraction, multipliers)
        for iteration in range(1, ITERATIONS + 1):
            stage = self.stage(output, fraction, multipliers)
            fresh = tangent.output is output
            taken = self._taken(stage, output, tangent, least, SHORTEST if fresh else 1.0)
            # Near the minimum the tangent before will do.
            if not fresh and not (taken and taken.length == 1 and taken.step.size < NEAR):
                formed = self._tangent(output)
                if formed is None:
                    return None, iteration
                tangent, taken = formed, self._taken(stage, output, formed, least, SHORTEST)
            if taken is None:
                return None, iteration
            if taken.step.size < ROUNDING:
                return Minimum(output, taken.step, tangent), iteration
            if taken.length == 0:
                return None, iteration
            output, least = taken.output, taken.potential
            if taken.length == 1 and taken.step.size < largest:
                return Minimum(output, taken.step, tangent), iteration
        return None, ITERATIONS

    def _taken(
        self, stage: ContactState, output: torch.Tensor, tangent: Tangent, least: float, shortest: float
    ) -> Taken | None:
        """So much of a step that the potential falls; None if a point is turned inside out.

        A finger that has left the cylinder may be unstable without it: its step is that of one held there.
        """
        forces = self.contact.forces(stage)
        touching = np.flatnonzero(forces > 0 if forces.any() else stage.contact > 0)
        step = self._step(stage, output, touching, tangent)
        length = 1.0
        while step is not None and length >= shortest:
            moved = output + length * step.change
            value = self._potential(moved, stage.fraction, stage.contact)
            if value < least:
                return Taken(step, moved, value, length)
            length /= 2
        return None if step is None else Taken(step, output, least, 0.0)

    def _tangent(self, output: torch.Tensor) -> Tangent | None:
        """The tangent at an output layer; None if a point is turned inside out."""
        gradient, hessian = self.network.energy.derivatives(output)
        if not torch.isfinite(gradient).all():
            return None
        return Tangent(output, hessian.factorised(REGULARISATION, definite=False))

    def _step(
        self, stage: ContactState, output: torch.Tensor, touching: IntArray, tangent: Tangent
    ) -> Step | None:
        """Newton's step with given multipliers and nodes that touch; None if a point is turned inside out."""
        gradient = self.network.energy.gradient(output)
        if not torch.isfinite(gradient).all():
            return None
        gap, normal = self.contact.gaps(stage)
        forces = stage.contact - self.contact.stiffness * gap
        along = self._rows(touching, normal)
        residual = gradient.numpy().ravel() - forces[touching] @ along
        turned = touching[forces[touching] > 0]
        rows = np.concatenate([along, self._rows(turned, normal[:, ::-1] * [-1.0, 1.0])])
        turning = -(gap + self.contact.radius)[turned] / forces[turned]
        compliance = np.append(np.full(len(touching), 1 / self.contact.stiffness), turning)
        free, *unit = tangent.factors.solve(np.concatenate([-residual[None], rows]))
        springs = ConstrainedElimination(rows, np.reshape(unit, rows.shape), compliance)
        change, _ = springs.solution(free)
        if residual @ change > 0:  # the curvature is negative that way: downhill is the other one
            change = -change
        work = abs(float(residual @ change))
        size = work / max(self.network.energy.total(output), work) if work else 0.0
        unstable = springs.unstable(tangent.factors.negative)
        return Step(torch.from_numpy(change).view_as(output), size, unstable)

    def _potential(self, output: torch.Tensor, fraction: float, multipliers: FloatArray) -> float:
        """Elastic energy and that of the augmented Lagrangian, N mm / mm; not a number if inside out."""
        forces = self.contact.forces(self.stage(output, fraction, multipliers))
        pressed = float((forces**2 - multipliers**2).sum()) / (2 * self.contact.stiffness)
        return self.network.energy.total(output) + pressed

    def _rows(self, nodes: IntArray, directions: FloatArray) -> FloatArray:
        """Functionals (t, U) of the displacement of t nodes along directions, (m, 2) of all nodes."""
        basis = self.network.energy.basis
        values = self.values[nodes].toarray().reshape(len(nodes), basis.windows.count, 1, basis.per_window)
        return np.asarray((values * directions[nodes][:, None, :, None]).reshape(len(nodes), 2 * basis.size))

    def _pressed_at_one_node(self, fraction: float) -> tuple[torch.Tensor, FloatArray]:
        """Output layer and forces (m,) by the linear response to a cylinder that touches the nearest node."""
        network = self.network
        rest = self.stage(network.zero_output, fraction, np.zeros(len(self.contact.positions)))
        gap, normal = self.contact.gaps(rest)
        nearest = np.array([gap.argmin()])
        row = self._rows(nearest, normal)
        _, hessian = network.energy.derivatives(network.zero_output)
        pressing = ConstrainedElimination(row, hessian.factorised(REGULARISATION).solve(row))
        change, force = pressing.solution(np.zeros(row.shape[1]), np.maximum(-gap[nearest], 0.0))
        rest.contact[nearest] = force
        return torch.from_numpy(change).view_as(network.zero_output), rest.contact

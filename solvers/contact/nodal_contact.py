"""A rigid cylinder pressed on the front face: gaps, forces, Coulomb friction and their tangent.

The gap is collocated at the nodes of the boundary `front`, which are the points of Simpson's rule on the
edges of quadratic elements. With g the gap of a node, positive outside the cylinder, and λ its multiplier,
the nodal force is q = max(0, λ - k g): the augmented Lagrangian of J. C. Simo, T. A. Laursen, Computers &
Structures 42 (1992) 97-116. In three dimensions the axis is along z, and k of a node is in proportion to its
level's share of the depth.

With friction a node slips by s along the cylinder since the last equilibrium, and the nodal friction is
-b s / max(|s|, ε): a node sticks until it slips by ε, `CREEP` of the travel. The bound b is μ λ of the
multiplier, not of the force, which keeps the tangent symmetric; as λ settles they become one (T. A. Laursen,
J. C. Simo, Computer Methods in Applied Mechanics and Engineering 108 (1993) 133-146).
"""

from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray
from pinnray.solvers.contact.cylinder import FRICTION_STEP, Cylinder, touching_centre
from pinnray.solvers.extrusion import NodalSpace
from pinnray.solvers.problem import Problem

CREEP = 1e-3
"""Slip in a step up to which a node sticks, over the travel; a tenth of it changes forces by 5 in 10,000."""


@dataclass(frozen=True, eq=False)
class Friction:
    """Friction at the nodes of the front: t = 1 component along the cylinder and, of a solid, 2 with z."""

    bounds: FloatArray  # Largest friction b, shape (l m,), N/mm
    places: FloatArray  # On the cylinder at the last equilibrium, from which slip counts, (l m, t), mm


@dataclass(frozen=True, eq=False)
class ContactState:
    """A stage of the load; only the front's nodal displacements are read."""

    fraction: float  # Fraction of the load
    nodal: FloatArray  # Displacements, shape (N, d), mm
    # Multipliers λ: in equilibrium the forces on the nodes of the front, shape (l m,), N/mm
    contact: FloatArray
    friction: Friction | None = field(default=None, kw_only=True)  # None without friction
    held: bool = field(default=False, kw_only=True)  # Whether nodes with a multiplier stay, even by tension


StateT = TypeVar("StateT", bound=ContactState)


@dataclass(frozen=True, eq=False)
class CylinderContact:
    """The cylinder and the m nodes of the front, by x, at each of l levels; l = 1 in the plane."""

    nodes: IntArray  # Numbers of the nodes, level by level, shape (l m,)
    positions: FloatArray  # Positions in the plane before the load, shape (m, 2), mm
    centre: FloatArray  # Centre of the cylinder before the load, where it touches the front, shape (2,), mm
    travel: FloatArray  # Displacement of the cylinder under the full load, shape (2,), mm
    radius: float  # mm
    stiffness: float  # k of a node, N/mm per mm, times its level's share
    coefficient: float  # μ of friction
    edges: IntArray  # Rows of `positions` along every edge, shape (e, degree + 1)
    shares: FloatArray  # Weights of the levels in a mean over the depth, shape (l,)

    @classmethod
    def of(cls, problem: Problem, space: NodalSpace) -> "CylinderContact":
        """The contact of a problem whose load is a `cylinder`."""
        load, edges = problem.load, problem.mesh.boundary("front")
        section = space.section
        nodes = section.boundary_nodes("front")
        nodes = nodes[np.argsort(section.nodes[nodes, 0])]
        columns = [edges[:, :1], edges[:, 1:]]
        if space.degree == 2:
            columns.insert(1, section.edge_nodes(edges)[:, None])
        starts = len(section.nodes) * np.arange(len(space.shares))
        order = np.argsort(nodes)
        return cls(
            nodes=(starts[:, None] + nodes).ravel(),
            positions=section.nodes[nodes],
            centre=touching_centre(problem),
            travel=load.values,
            radius=float(load.radius or 0),
            # More would need fewer updates of the multipliers but more Newton iterations.
            stiffness=10.0 * problem.material.young,
            coefficient=load.friction,
            edges=order[np.searchsorted(nodes[order], np.concatenate(columns, axis=1))],
            shares=space.shares,
        )

    @property
    def longest_step(self) -> float:
        """The fraction of the load in which the cylinder moves by half its radius; FRICTION_STEP with it."""
        share = FRICTION_STEP if self.coefficient else 0.5
        return float(share * self.radius / np.linalg.norm(self.travel))

    def cylinder(self, state: ContactState) -> Cylinder:
        """The cylinder at a stage."""
        return Cylinder(self.radius, self.centre + state.fraction * self.travel, self.coefficient)

    def gaps(self, state: ContactState) -> tuple[FloatArray, FloatArray]:
        """Distances g from the cylinder, shape (l m,), mm, and its outer normals n there, shape (l m, 2)."""
        cylinder, points = self.cylinder(state), self.moved(state.nodal)
        return cylinder.gaps(points), cylinder.axes(points)[0]

    def forces(self, state: ContactState) -> FloatArray:
        """Forces q along the outer normals, shape (l m,), N/mm, tension where held; λ is `state.contact`."""
        forces = state.contact - self._stiffness * self.gaps(state)[0]
        return np.where(_holds(state), forces, np.maximum(0.0, forces))

    def holding(self, guess: StateT) -> StateT:
        """A guess from which Newton's method starts: held if the extrapolation took nodes off the cylinder.

        Else its first step would be that of a finger set free.
        """
        free = (guess.contact > 0) & (self.forces(guess) == 0)
        return replace(guess, held=True) if free.any() else guess

    def started(self, equilibrium: ContactState) -> Friction | None:
        """Friction as a step begins at an equilibrium: the same; None without friction."""
        if not self.coefficient:
            return None
        places, before = self.places(equilibrium), equilibrium.friction
        if before is None:
            return Friction(np.zeros(len(places)), places)
        return replace(before, places=places)

    def places(self, state: ContactState) -> FloatArray:
        """Places on the cylinder: along it from its lowest line and, of a solid, z, shape (l m, t), mm."""
        around = self.cylinder(state).places(self.moved(state.nodal))
        return np.column_stack([around, *state.nodal[self.nodes, 2:].T])

    def slips(self, state: ContactState) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Slip s, shape (l m, t), mm, its size or ε if that is more, and whether it is less, (l m,) each."""
        assert state.friction is not None
        slip = self.places(state) - state.friction.places
        size, creep = np.linalg.norm(slip, axis=1), CREEP * float(np.linalg.norm(self.travel))
        return slip, np.maximum(size, creep), size < creep

    def frictions(self, state: ContactState) -> FloatArray:
        """Friction on the finger along the cylinder and, of a solid, along z, (l m, t), N/mm."""
        assert state.friction is not None
        slip, size, _ = self.slips(state)
        return np.asarray(-(state.friction.bounds / size)[:, None] * slip)

    def settled(self, state: StateT) -> tuple[StateT, float]:
        """The state with its forces as multipliers, and how far off the old ones were, in gaps, mm."""
        contact = self.forces(state)
        gap, _ = self.gaps(state)
        off = float(max(np.abs(gap[contact > 0]).max(initial=0.0), -gap.min()))
        if (old := state.friction) is None:
            return replace(state, contact=contact), off
        bounds = self.coefficient * contact
        off = max(off, float((np.abs(bounds - old.bounds) / self._stiffness).max()))
        return replace(state, contact=contact, friction=replace(old, bounds=bounds)), off

    def gradient(self, state: ContactState) -> FloatArray:
        """Residual force - q n less friction, shape (l m, 2) or, with friction on a solid, (l m, 3), N/mm.

        Without friction it is the derivative of Σ (q^2 - λ^2) / 2 k.
        """
        pressing = -self.forces(state)[:, None] * self.gaps(state)[1]
        if state.friction is None:
            return pressing
        force = self.frictions(state)
        around = force[:, :1] * self.cylinder(state).place_slopes(self.moved(state.nodal))
        return np.column_stack([pressing - around, *-force[:, 1:].T])

    def tangent(self, state: ContactState) -> FloatArray:
        """Derivative of the gradient by its components, (l m, 2, 2) or (l m, 3, 3).

        Blocks k n n^T - q (I - n n^T) / r of the pressure, without the last term for tension; r = g + radius.
        Friction f along t adds f radius (t n^T + n t^T) / r^2 and, with the derivative J of a node's place,
        b J^T J / ε where it sticks, and else b J^T (I - s s^T / |s|^2) J / |s|.
        """
        (gap, normal), force = self.gaps(state), self.forces(state)
        distance = gap + self.radius
        across = np.einsum("mi,mj->mij", normal, normal)
        turning = (np.maximum(0.0, force) / distance)[:, None, None] * (np.eye(2) - across)
        stiffness = ((force > 0) | _holds(state)) * self._stiffness
        pressing = np.asarray(stiffness[:, None, None] * across - turning)
        if state.friction is None:
            return pressing
        friction = self.frictions(state)
        count = friction.shape[1]
        slopes = np.zeros((len(normal), count, count + 1))
        slopes[:, 0, :2] = self.cylinder(state).place_slopes(self.moved(state.nodal))
        slopes[:, 1:, 2:] = np.eye(count - 1)
        slip, size, sticks = self.slips(state)
        along = np.where(sticks[:, None], 0.0, slip / size[:, None])
        turned = np.eye(count) - np.einsum("mt,ms->mts", along, along)
        rate = (state.friction.bounds / size)[:, None, None] * turned
        blocks = np.einsum("mti,mts,msj->mij", slopes, rate, slopes)
        bend = np.einsum("m,mi,mj->mij", friction[:, 0] / distance, slopes[:, 0, :2], normal)
        blocks[:, :2, :2] += pressing + bend + bend.transpose(0, 2, 1)
        return np.asarray(blocks)

    @property
    def _stiffness(self) -> FloatArray:
        return np.repeat(self.stiffness * self.shares, len(self.positions))

    def moved(self, nodal: FloatArray) -> FloatArray:
        """Positions of the deformed nodes in the plane, shape (l m, 2), mm."""
        return np.tile(self.positions, (len(self.shares), 1)) + nodal[self.nodes, :2]

    def front(self, nodal: FloatArray) -> FloatArray:
        """The deformed front, meant over the depth, shape (m, 2), mm."""
        return np.tensordot(self.shares, self.moved(nodal).reshape(len(self.shares), -1, 2), axes=1)

    def lengths(self, nodal: FloatArray) -> FloatArray:
        """Weights of the m places in an integral along the deformed front, shape (m,), mm."""
        moved = self.front(nodal)[self.edges]
        lengths = np.linalg.norm(np.diff(moved, axis=1), axis=2).sum(axis=1)
        shares = {2: (1 / 2, 1 / 2), 3: (1 / 6, 4 / 6, 1 / 6)}[self.edges.shape[1]]
        weights = np.outer(lengths, shares)
        return np.bincount(self.edges.ravel(), weights.ravel(), len(self.positions)).astype(np.float64)


def _holds(state: ContactState) -> BoolArray:
    """The nodes that stay on the cylinder even by tension, shape (l m,)."""
    return np.asarray(state.held & (state.contact > 0))

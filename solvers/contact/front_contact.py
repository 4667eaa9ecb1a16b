"""A rigid cylinder with friction against the front of a finger that answers forces by displacements.

The m points of the front near the cylinder are at y = Y + C f under forces f on them, with the compliance C
of the finger about a state. The cylinder, of radius R about a centre c, pushes a point by q along its outer
normal n = (y - c) / r, r = |y - c|, and by t along it, counterclockwise. With the gap g = r - R, the slip s
since the last equilibrium and any k > 0,

    q = max(0, q - k g)        t = the nearest to t - k s from -μ q to μ q

which says that there is no gap where it pushes, and no slip where friction could give more. Newton's method
solves both for f, and the derivatives of f follow from them. Source: P. Alart, A. Curnier, Computer Methods
in Applied Mechanics and Engineering 92 (1991) 353-375.
"""

from typing import NamedTuple

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.contact.cylinder import Cylinder

ITERATIONS, SETTLED = 30, 1e-9
"""Newton iterations for the forces, and the step of a force over the largest one that ends them."""
PUSHES = (1.0, 10.0, 0.1)
"""k times the mean trace of a point's own compliance, in turn: of 1,040 problems on the way of fits the first
does not solve 8 and all together 2, of 400 random ones, which start without forces, 16 and 7."""


class Balance(NamedTuple):
    """What forces miss of the two conditions at m points, (2, m), and its derivatives."""

    missed: FloatArray
    by_force: FloatArray  # By all forces, shape (2 m, 2 m)
    by_point: FloatArray  # By a point's own place, shape (2, m, 2)
    by_slip: FloatArray  # Of the second condition, shape (m,); zero where a point slips
    by_friction: FloatArray  # Of the second one by μ, shape (m,)


class FrontContact(NamedTuple):
    """The contact with a finger about a state."""

    cylinder: Cylinder  # At a stage of its way
    compliance: FloatArray  # C, shape (2 m, 2 m), mm per N/mm
    before: FloatArray  # Places of the points on the cylinder at the last equilibrium, shape (m,), mm

    def forces(self, free: FloatArray, start: FloatArray) -> FloatArray | None:
        """Forces (m, 2), N/mm, for places Y (m, 2), mm, without them; None where none are found.

        The search starts from forces (m, 2).
        """
        for push in PUSHES:
            forces = start
            for _ in range(ITERATIONS):
                balance = self.balance(free, forces, push)
                try:
                    step = np.linalg.solve(balance.by_force, -balance.missed.ravel()).reshape(-1, 2)
                except np.linalg.LinAlgError:
                    break
                forces = forces + step
                least = SETTLED * np.abs(forces).max(initial=0.0)
                if np.abs(step).max(initial=0.0) <= least:
                    return np.where(np.abs(forces).max(axis=1, keepdims=True) > least, forces, 0.0)
        return None

    def balance(self, free: FloatArray, forces: FloatArray, push: float = 1.0) -> Balance:
        """What forces (m, 2), N/mm, miss for places Y (m, 2), mm, without them; see `PUSHES`."""
        count, μ = len(forces), self.cylinder.friction
        points = free + (self.compliance @ forces.ravel()).reshape(-1, 2)
        (normal, along), gap = self.cylinder.axes(points), self.cylinder.gaps(points)
        slip, moved = self.cylinder.places(points) - self.before, self.cylinder.place_slopes(points)
        q, t = (forces * normal).sum(axis=1), (forces * along).sum(axis=1)
        turned = along / (gap + self.cylinder.radius)[:, None]
        q_moved, t_moved = t[:, None] * turned, -q[:, None] * turned
        k = push * count / (np.trace(self.compliance) or 1.0)
        touches, tried = q - k * gap > 0, t - k * slip
        sticks = touches & (np.abs(tried) <= μ * q)
        way = np.sign(tried) * (touches & ~sticks)
        missed = np.stack([np.where(touches, k * gap, q), np.where(sticks, k * slip, t - μ * way * q)])
        touches_, sticks_, rubs = touches[:, None], sticks[:, None], μ * way[:, None]
        by_point = np.stack(
            [
                np.where(touches_, k * normal, q_moved),
                np.where(sticks_, k * moved, t_moved - rubs * q_moved),
            ]
        )
        own = np.stack([np.where(touches_, 0.0, normal), np.where(sticks_, 0.0, along - rubs * normal)])
        by_force = np.einsum("ami,minj->amnj", by_point, self.compliance.reshape(count, 2, count, 2))
        by_force[:, np.arange(count), np.arange(count)] += own
        by_force = by_force.reshape(2 * count, 2 * count)
        return Balance(missed, by_force, by_point, k * sticks, -way * q)

    def slopes(
        self,
        free: FloatArray,
        forces: FloatArray,
        moved: FloatArray,
        friction: FloatArray,
        before: FloatArray,
    ) -> FloatArray:
        """Derivatives of the forces that were found by p parameters, shape (p, m, 2).

        Args:
            free: Y, shape (m, 2), mm.
            forces: What was found, shape (m, 2), N/mm.
            moved: Derivatives of Y - c, shape (p, m, 2).
            friction: Of μ, shape (p,).
            before: Of the places at the last equilibrium, shape (p, m).
        """
        balance = self.balance(free, forces)
        missed = np.einsum("ami,pmi->pam", balance.by_point, moved)
        missed[:, 1] += np.outer(friction, balance.by_friction) - before * balance.by_slip
        found = np.linalg.solve(balance.by_force, -missed.reshape(len(moved), -1).T)
        return np.asarray(found.T.reshape(moved.shape))

"""A rigid cylinder with friction against the front of a finger that answers forces by displacements.

The m points of the front near the cylinder are at y = Y + C f under forces f on them, with the compliance C
of the finger about a state. The cylinder, of radius R about a centre c, pushes a point by q along its outer
normal n = (y - c) / r, r = |y - c|, and by t along it, counterclockwise. With the gap g = r - R, the slip s
since the last equilibrium, its parts s = s⁺ - s⁻ and what friction could give more, μ q - t and μ q + t,

    0 ≤ q ⟂ g ≥ 0        0 ≤ μ q - t ⟂ s⁻ ≥ 0        0 ≤ μ q + t ⟂ s⁺ ≥ 0

About known points and forces these are linear complementarity conditions, which C. E. Lemke's method solves
(A. Klarbring, Computer Methods in Applied Mechanics and Engineering 58 (1986) 185-200). What touches, sticks
and slips held, they are equations, whose derivatives are exact.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray

SWAPS = 8
"""Times that what touches and slips is guessed from the last guess."""


class Cylinder(NamedTuple):
    """A cylinder at a stage of its way."""

    radius: float  # R, mm
    centre: FloatArray  # c, shape (2,), mm
    friction: float  # μ

    def gaps(self, points: FloatArray) -> FloatArray:
        """Distances g of points (m, 2), mm, from it, shape (m,)."""
        return np.asarray(np.linalg.norm(points - self.centre, axis=1) - self.radius)

    def places(self, points: FloatArray) -> FloatArray:
        """Places of points along it from its lowest line, shape (m,), mm."""
        away = points - self.centre
        return np.asarray(self.radius * np.arctan2(away[:, 0], -away[:, 1]))

    def place_slopes(self, points: FloatArray) -> FloatArray:
        """Derivatives of the places by the points, shape (m, 2)."""
        away = points - self.centre
        turned = np.stack([-away[:, 1], away[:, 0]], 1)
        return np.asarray(self.radius / (away**2).sum(axis=1)[:, None] * turned)


class Pressed(NamedTuple):
    """The points of the front in equilibrium with the cylinder."""

    forces: FloatArray  # f, shape (m, 2), N/mm
    touches: BoolArray  # Shape (m,)
    slips: FloatArray  # Sign of t where a point slips, else zero, shape (m,)


@dataclass(frozen=True, eq=False)
class WayPoint:
    """An equilibrium on the way, with derivatives by p unknowns; the front has m points."""

    share: float  # Of the travel
    state: FloatArray
    forces: FloatArray  # On the front, shape (m, 2), N/mm
    places: FloatArray  # Of the front on the cylinder, shape (m,), mm
    touches: BoolArray  # Shape (m,)
    slips: FloatArray  # See `Pressed`
    slopes: FloatArray  # Of the state, shape (p, *shape)
    force_slopes: FloatArray  # Shape (p, m, 2)
    place_slopes: FloatArray  # Shape (p, m)
    final: bool = False  # Whether it is only moved to first order, not solved again

    def moved(self, step: FloatArray) -> "WayPoint":
        """The stage after a step of the unknowns, shape (p,), to first order."""
        return replace(
            self,
            state=self.state + np.tensordot(step, self.slopes, axes=1),
            forces=self.forces + np.tensordot(step, self.force_slopes, axes=1),
            places=self.places + step @ self.place_slopes,
        )


class FrontContact:
    """The conditions about points and forces that are nearly those of equilibrium.

    Args:
        cylinder: At a stage of its way.
        compliance: C, shape (2 m, 2 m), mm per N/mm.
        points: Shape (m, 2), mm.
        forces: On them, shape (m, 2), N/mm.
        before: Their places on the cylinder at the last equilibrium, shape (m,), mm.
    """

    def __init__(
        self,
        cylinder: Cylinder,
        compliance: FloatArray,
        points: FloatArray,
        forces: FloatArray,
        before: FloatArray,
    ) -> None:
        self._cylinder, self._points = cylinder, points
        away = points - cylinder.centre
        distance = np.linalg.norm(away, axis=1)
        normal = away / distance[:, None]
        along = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
        q, t = (forces * normal).sum(axis=1), (forces * along).sum(axis=1)
        # f = q n + t τ + turning (y - points), to first order
        turned = (q[:, None] * along - t[:, None] * normal) / distance[:, None]
        self._turning = _diagonal(turned[:, :, None] * along[:, None])
        self._axes = np.stack([_diagonal(normal[:, :, None]), _diagonal(along[:, :, None])])  # (2, 2 m, m)
        self._measured = np.concatenate(
            [self._axes[0].T, (cylinder.radius / distance)[:, None] * self._axes[1].T]
        )  # of the gaps and slips by the points
        self._stiffer = np.linalg.inv(np.eye(len(compliance)) - compliance @ self._turning)
        self._answer = self._stiffer @ compliance @ np.concatenate(self._axes, axis=1)
        self._offset = np.concatenate([cylinder.gaps(points), cylinder.places(points) - before])

    def pressed(self, free: FloatArray, touches: BoolArray, slips: FloatArray) -> Pressed | None:
        """Equilibrium for places Y (m, 2) without forces; None where there is none.

        The search begins with what touched and slipped last, as in `Pressed`.
        """
        none = np.zeros(len(touches), dtype=np.bool_)
        return self._solved(free, self._offset, touches, slips) or self._solved(free, None, none, slips)

    def _solved(
        self, free: FloatArray, near: FloatArray | None, touches: BoolArray, slips: FloatArray
    ) -> Pressed | None:
        """That from gaps and slips near those of equilibrium, (2 m,), by changes of what touches and slips.

        Without them it is by `lemke`.
        """
        count, friction = len(free), self._cylinder.friction
        moved = self._stiffer @ (free - self._points).ravel()
        loose = self._offset + self._measured @ moved
        # The way along the cylinder is counted against the slip, which then needs no pivot.
        way = np.where((loose if near is None else near)[count:] > 0, -1.0, 1.0)
        matrix = (self._measured @ self._answer).reshape(2, count, 2, count)
        matrix[1] *= way[:, None, None]
        matrix[:, :, 1] *= way
        one, none = np.eye(count), np.zeros((count, count))
        (nn, nt), (tn, tt) = ([part[:, j] for j in range(2)] for part in matrix)
        whole = np.block(
            [
                [nn + friction * nt, -nt, none],
                [-tn - friction * tt, tt, one],
                [2 * friction * one, -one, none],
            ]
        )
        offset = np.concatenate([loose[:count], -way * loose[count:], np.zeros(count)])
        if near is None:
            found = lemke(whole, offset)
        else:
            guess = np.concatenate([touches, touches & (slips != way), touches & (slips == -way)])
            found = swapped(whole, offset, guess)
        if found is None:
            return None
        q, reserve, forward = found.reshape(3, -1)
        t = way * (friction * q - reserve)
        touches = q > 0
        sticks = reserve > 1e-9 * q
        slips = way * np.where(forward > 0, -1.0, np.where(sticks, 0.0, 1.0)) * touches
        moved = moved + self._answer @ np.concatenate([q, t])
        forces = self._axes[0] @ q + self._axes[1] @ t + self._turning @ moved
        return Pressed(forces.reshape(-1, 2), touches, slips)

    def slopes(
        self, found: Pressed, free: FloatArray, centre: FloatArray, friction: FloatArray, before: FloatArray
    ) -> FloatArray:
        """Derivatives of the forces by p parameters, shape (p, m, 2); what touches and slips is held.

        Args:
            found: What was found.
            free: Derivatives of Y, shape (p, m, 2).
            centre: Of the cylinder's centre, shape (p, 2).
            friction: Of μ, shape (p,).
            before: Of the places at the last equilibrium, shape (p, m).
        """
        count = len(found.touches)
        touching, sticking = np.flatnonzero(found.touches), np.flatnonzero(found.touches & (found.slips == 0))
        moved = (free - centre[:, None]).reshape(len(free), -1) @ self._stiffer.T
        q = (self._axes[0].T @ found.forces.ravel()) * found.slips
        # t of what slips follows q and μ
        rubbed = np.concatenate([np.zeros((len(friction), count)), np.outer(friction, q)], axis=1)
        units = np.eye(2 * count)
        follows = units[touching]
        follows[:, count:] += self._cylinder.friction * found.slips[touching, None] * units[touching, :count]
        ways = np.concatenate([follows, units[count + sticking]])
        rows = np.concatenate([touching, count + sticking])
        answer = self._measured[rows] @ self._answer
        missed = (moved + rubbed @ self._answer.T) @ self._measured[rows].T
        missed[:, len(touching) :] -= before[:, sticking]
        pushed = rubbed - np.linalg.solve(answer @ ways.T, missed.T).T @ ways
        moved = moved + pushed @ self._answer.T
        axes = np.concatenate(self._axes, axis=1)
        return np.asarray((pushed @ axes.T + moved @ self._turning.T).reshape(free.shape))


def swapped(matrix: FloatArray, offset: FloatArray, guess: BoolArray) -> FloatArray | None:
    """The solution z ≥ 0 of w = M z + b ≥ 0, z . w = 0, for M (n, n) and b (n,); None where none is found.

    The guess is the mask of the z that are thought to be positive: those that are not, and the w that are
    negative, change over a few times. The n are q, μ q - t and s⁺ of the points.
    """
    count = len(offset) // 3
    positive, slack = guess.copy(), 1e-9 * float(np.abs(offset).max(initial=0.0))
    for _ in range(SWAPS):
        z = np.zeros(len(offset))
        try:
            z[positive] = np.linalg.solve(matrix[np.ix_(positive, positive)], -offset[positive])
        except np.linalg.LinAlgError:
            return None
        wrong = np.where(positive, z, matrix @ z + offset) < -slack
        if not wrong.any():
            return np.maximum(z, 0.0)
        wrong[2 * count :] &= ~wrong[:count]  # what ceases to touch has no friction either
        positive = positive ^ wrong
    return None


def lemke(matrix: FloatArray, offset: FloatArray) -> FloatArray | None:
    """As `swapped`, from z = 0; None where a ray is met.

    Source: R. W. Cottle, J.-S. Pang, R. E. Stone, The Linear Complementarity Problem, Academic Press 1992,
    algorithm 4.4.5.
    """
    count = len(offset)
    extra, size = 2 * count, float(np.abs(offset).max(initial=0.0))
    # Slightly different offsets leave no ties.
    b = offset + 1e-12 * size * (1 + np.arange(count) / count)
    table = np.column_stack([np.eye(count), -matrix, -np.ones(count), b])  # w - M z - z0 = b
    basis, row, entering = np.arange(count), int(b.argmin()), extra
    if b[row] >= 0:
        return np.zeros(count)
    for _ in range(20 * count):
        table[row] /= table[row, entering]
        others = table[:, entering].copy()
        others[row] = 0.0
        table -= np.outer(others, table[row])
        leaving, basis[row] = int(basis[row]), entering
        if leaving == extra:
            found = np.zeros(extra + 1)
            found[basis] = table[:, -1]
            return np.maximum(found[count:extra], 0.0)
        entering = leaving + count if leaving < count else leaving - count
        column = table[:, entering]
        rises = column > 1e-9
        if not rises.any():
            return None
        row = int(np.where(rises, table[:, -1] / np.where(rises, column, 1.0), np.inf).argmin())
    return None


def _diagonal(blocks: FloatArray) -> FloatArray:
    """The matrix (a m, b m) with the blocks (m, a, b) on its diagonal."""
    count, a, b = blocks.shape
    found = np.zeros((count, a, count, b))
    found[np.arange(count), :, np.arange(count)] = blocks
    return found.reshape(count * a, count * b)

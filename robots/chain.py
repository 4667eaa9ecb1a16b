"""A chain of links along the front face: where hinges and a slide carry its points, and its masses.

Coordinates are q = (slide, turns). The first hinge also slides along the finger, because the front wall is
pushed and pulled most next to the base.

Units: m, kg, rad.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares

from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray, IntArray

MM = 1e-3
"""Metres in a millimetre."""


@dataclass(frozen=True, eq=False)
class Chain:
    """Links between points of the front face; link 0 is fixed, and link i turns about hinge i.

    Attributes:
        points: The front's end at the base, the n hinges and the front's end at the tip, shape (n + 2, 2), m.
        masses: Of the links, the fixed one first, shape (n + 1,), kg.
        centres: Of their masses, shape (n + 1, 2), m.
        inertias: About these, out of the plane, shape (n + 1,), kg m^2.
    """

    points: FloatArray
    masses: FloatArray
    centres: FloatArray
    inertias: FloatArray

    @classmethod
    def of(cls, mesh: TriangleMesh, front: FloatArray, hinges: int, density: float) -> "Chain":
        """Links of equal extent along x, the first and the last half as long.

        Each link carries the slice of the section between the abscissae of its ends; what is behind the
        front's ends goes with the first and the last one.

        Args:
            mesh: The section, mm.
            front: Points of its front face from base to tip, shape (m, 2), mm.
            hinges: Number of hinges.
            density: Of the material, kg/m^3.
        """
        start, end = front[[0, -1], 0]
        x = np.concatenate([[start], start + (np.arange(hinges) + 0.5) * (end - start) / hinges, [end]])
        points = MM * np.column_stack([x, np.interp(x, *front.T)])
        corners = MM * mesh.points[mesh.triangles]
        middles = corners.mean(axis=1)
        mass = density * MM * mesh.depth * MM**2 * mesh.areas
        # A triangle's second moment about its own middle is mass / 12 times the sum over its corners.
        own = mass / 12 * ((corners - middles[:, None]) ** 2).sum(axis=(1, 2))
        link = _link(points, middles[:, 0])

        def summed(values: FloatArray) -> FloatArray:
            return np.bincount(link, values, hinges + 1).astype(np.float64)

        total = summed(mass)
        centres = np.stack([summed(mass * each) for each in middles.T], axis=1) / total[:, None]
        spread = mass * ((middles - centres[link]) ** 2).sum(axis=1)
        return cls(points, total, centres, summed(own + spread))

    @property
    def hinges(self) -> int:
        """Number n of hinges."""
        return len(self.points) - 2

    @property
    def axis(self) -> FloatArray:
        """Direction of the slide, shape (2,)."""
        along = self.points[1] - self.points[0]
        return np.asarray(along / np.linalg.norm(along))

    def link_of(self, rest: FloatArray) -> IntArray:
        """Number of the link that carries points of the body, shape (m, 2), m: shape (m,)."""
        return _link(self.points, rest[:, 0])

    def placed(self, q: FloatArray, rest: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Where the points of the body whose rest places are given are, and how that changes with q.

        Args:
            q: Coordinates, shape (n + 1,).
            rest: Places at rest, shape (m, 2), m.

        Returns:
            Places, shape (m, 2), m, and their derivatives, shape (m, 2, n + 1).
        """
        turns = np.concatenate([[0.0], np.cumsum(q[1:])])
        cos, sin = np.cos(turns), np.sin(turns)
        turning = np.moveaxis(np.array([[cos, -sin], [sin, cos]]), 2, 0)
        steps = np.einsum("kij,kj->ki", turning[1:-1], np.diff(self.points[1:-1], axis=0))
        first = self.points[1] + q[0] * self.axis
        joints = np.concatenate([first[None], first + np.cumsum(steps, axis=0)])
        link = self.link_of(rest)
        last = np.maximum(link, 1) - 1  # number of the hinge that moves the point
        away = np.einsum("mij,mj->mi", turning[link], rest - self.points[1 + last])
        places = np.where(link[:, None] > 0, joints[last] + away, rest)
        turned = np.arange(self.hinges) < link[:, None]
        arms = np.where(turned[..., None], places[:, None] - joints, 0.0)
        slopes = np.empty((len(rest), 2, self.hinges + 1))
        slopes[:, :, 0] = (link > 0)[:, None] * self.axis
        slopes[:, 0, 1:], slopes[:, 1, 1:] = -arms[..., 1], arms[..., 0]
        return places, slopes

    @cached_property
    def inertia(self) -> FloatArray:
        """Mass matrix at rest, shape (n + 1, n + 1)."""
        _, slopes = self.placed(np.zeros(self.hinges + 1), self.centres)
        turned = np.tri(self.hinges + 1, self.hinges + 1, 0)
        turned[:, 0] = 0.0
        moving = np.einsum("mik,mil,m->kl", slopes, slopes, self.masses)
        return np.asarray(moving + np.einsum("mk,ml,m->kl", turned, turned, self.inertias))

    def bent_as(self, rest: FloatArray, moved: FloatArray) -> FloatArray:
        """The coordinates, shape (n + 1,), that fit displaced points best, both of shape (m, 2), m."""
        count = self.hinges + 1
        fit = least_squares(
            lambda q: (self.placed(q, rest)[0] - rest - moved).ravel(),
            np.zeros(count),
            jac=lambda q: self.placed(q, rest)[1].reshape(-1, count),
        )
        return np.asarray(fit.x)


def _link(points: FloatArray, x: FloatArray) -> IntArray:
    return np.asarray(np.searchsorted(points[1:-1, 0], x, side="right"), dtype=np.int64)

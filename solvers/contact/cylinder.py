"""A rigid cylinder above the front face: where it touches, and places on it."""

from typing import NamedTuple

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.problem import Problem, contact_ends, front_points

FRICTION_STEP = 0.2
"""Travel of a cylinder with friction in one step over its radius; within a step slip has one direction."""


class Cylinder(NamedTuple):
    """A cylinder at a stage of its way."""

    radius: float  # R, mm
    centre: FloatArray  # c, shape (2,), mm
    friction: float  # μ

    def gaps(self, points: FloatArray) -> FloatArray:
        """Distances g of points (m, 2), mm, from it, shape (m,)."""
        return np.asarray(np.linalg.norm(points - self.centre, axis=1) - self.radius)

    def axes(self, points: FloatArray) -> FloatArray:
        """Outer normals there and, counterclockwise, directions along it, shape (2, m, 2)."""
        away = points - self.centre
        normal = away / np.linalg.norm(away, axis=1)[:, None]
        return np.stack([normal, np.stack([-normal[:, 1], normal[:, 0]], axis=1)])

    def places(self, points: FloatArray) -> FloatArray:
        """Places of points along it from its lowest line, shape (m,), mm."""
        away = points - self.centre
        return np.asarray(self.radius * np.arctan2(away[:, 0], -away[:, 1]))

    def place_slopes(self, points: FloatArray) -> FloatArray:
        """Derivatives of the places by the points, shape (m, 2)."""
        return np.asarray((self.radius / (self.gaps(points) + self.radius))[:, None] * self.axes(points)[1])


def touching_centre(problem: Problem, middle: float | None = None) -> FloatArray:
    """Centre of the cylinder, shape (2,), mm: as low above an abscissa as the front lets it.

    By default it is that of the contact's middle, mm.
    """
    radius = float(problem.load.radius or 0)
    middle = float(np.mean(contact_ends(problem))) if middle is None else middle
    front = problem.mesh.points[np.unique(problem.mesh.boundary("front"))]
    under = np.concatenate([front_points(problem.mesh, np.array([middle])), front])
    under = under[np.abs(under[:, 0] - middle) < radius]
    heights = under[:, 1] + np.sqrt(radius**2 - (under[:, 0] - middle) ** 2)
    return np.array([middle, heights.max()])

"""Similarities between the frames of pictures and drawing, by which measured displacements may be off.

A point at rest is measured at X, in a picture that a similarity D takes to the drawing; pressed it is
measured at x, in a picture to which a similarity B takes the picture at rest. A finger with the
displacement u then shows

    x - X = B(D^-1(D(X) + u(D(X)))) - X
"""

from dataclasses import dataclass

import numpy as np

from geometry.arrays import FloatArray
from geometry.observations import Registration
from solvers.assimilation.estimation import Parameter

PARTS = {"turn": "deg", "shift_x": "mm", "shift_y": "mm", "scale": ""}
"""Values of a similarity, with their units."""


def registration_parameters(picture: str, registration: Registration) -> list[Parameter]:
    """The unknown values of the similarity of a picture, with their priors; none where it is fixed."""
    deviations = (registration.turn, registration.shift, registration.shift, registration.scale)
    return [
        Parameter(f"{picture}_{part}", unit, 0.0, deviation)
        for (part, unit), deviation in zip(PARTS.items(), deviations, strict=True)
        if deviation
    ]


@dataclass(frozen=True, eq=False)
class Similarity:
    """A turn and a change of scale about a centre, then a shift."""

    centre: FloatArray  # Shape (2,), mm
    values: FloatArray  # Turn, degrees; shift along x and y, mm; change of scale, a share: shape (4,)

    def moved(self, points: FloatArray) -> FloatArray:
        """New places of points, both of shape (n, 2), mm."""
        added = self.matrix - np.eye(2)
        return np.asarray(points + (self.values[1:3] + (points - self.centre) @ added.T))

    def undone(self, points: FloatArray) -> FloatArray:
        """Places from which points, shape (n, 2), mm, come."""
        back = np.linalg.inv(self.matrix)
        shift = back @ self.values[1:3]
        return np.asarray(points + ((points - self.centre) @ (back - np.eye(2)).T - shift))

    def slopes(self, points: FloatArray) -> FloatArray:
        """Derivatives (4, n, 2) of the new places of points, shape (n, 2), by the values."""
        offset, degree = points - self.centre, np.pi / 180
        turn = degree * self.values[0]
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
        by_shift = np.broadcast_to(np.eye(2)[:, None], (2, *points.shape))
        by_turn, by_scale = degree * offset @ (quarter @ self.matrix).T, offset @ rotation.T
        return np.concatenate([by_turn[None], by_shift, by_scale[None]])

    @property
    def matrix(self) -> FloatArray:
        """The scaled rotation, shape (2, 2)."""
        turn = np.radians(self.values[0])
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        return np.asarray((1 + self.values[3]) * rotation)

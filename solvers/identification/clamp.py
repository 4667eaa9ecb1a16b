"""The clamp as an elastic layer: the straight base shifts and turns under the indenter's force.

A layer of compliance ℓ (mm) answers a displacement u of the base by the traction E u / ℓ. With the base's
length b, its middle x_b and the integral I of the squared distance from it, a base that stays straight under
the force f at the point x shifts by ℓ f / (E b) and turns by ℓ (x - x_b) × f / (E I). The finger moves with
it as a rigid body.
"""

from dataclasses import dataclass

import numpy as np

from geometry.arrays import FloatArray
from geometry.mesh.quadrature import edge_quadrature
from geometry.mesh.triangle_mesh import TriangleMesh

QUARTER = np.array([[0.0, -1.0], [1.0, 0.0]])
"""Rotation by 90 degrees."""


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """A rotation about a point, then a shift.

    Attributes:
        centre: Shape (2,), mm.
        shift: Shape (2,), mm.
        turn: Angle, rad.
    """

    centre: FloatArray
    shift: FloatArray
    turn: float

    @property
    def rotation(self) -> FloatArray:
        """The rotation's matrix, shape (2, 2)."""
        return np.asarray(np.cos(self.turn) * np.eye(2) + np.sin(self.turn) * QUARTER)

    def moved(self, places: FloatArray) -> FloatArray:
        """New places of points, both of shape (n, 2), mm."""
        return np.asarray(self.centre + self.shift + (places - self.centre) @ self.rotation.T)

    def slopes(
        self, places: FloatArray, place_slopes: FloatArray, shifts: FloatArray, turns: FloatArray
    ) -> FloatArray:
        """Derivatives of the new places by p parameters, shape (p, n, 2).

        Args:
            places: Shape (n, 2), mm.
            place_slopes: Their derivatives, shape (p, n, 2).
            shifts: Derivatives of the shift, shape (p, 2).
            turns: Derivatives of the angle, shape (p,).
        """
        turned = (places - self.centre) @ (QUARTER @ self.rotation).T
        return np.asarray(place_slopes @ self.rotation.T + shifts[:, None] + turns[:, None, None] * turned)


@dataclass(frozen=True, eq=False)
class Clamp:
    """The base on its layer.

    Attributes:
        length: b, mm.
        centre: x_b, shape (2,), mm.
        inertia: I, mm³.
    """

    length: float
    centre: FloatArray
    inertia: float

    @classmethod
    def of(cls, mesh: TriangleMesh) -> "Clamp":
        """The base of a mesh, in one piece or several."""
        points, lengths = edge_quadrature(mesh, "base")
        centre = lengths @ points / lengths.sum()
        return cls(float(lengths.sum()), centre, float(lengths @ ((points - centre) ** 2).sum(axis=1)))

    def motion(self, softness: float, force: FloatArray, place: FloatArray) -> RigidMotion:
        """The motion for a softness ℓ / E, mm/MPa, under a force (2,), N/mm, at a place (2,), mm."""
        moment = _cross(place - self.centre, force)
        return RigidMotion(
            self.centre, softness * force / self.length, float(softness * moment / self.inertia)
        )

    def slopes(
        self,
        softness: float,
        force: FloatArray,
        place: FloatArray,
        softness_slopes: FloatArray,
        force_slopes: FloatArray,
        place_slopes: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives of shift, (p, 2), and angle, (p,), by p parameters from those of the arguments."""
        shifts = (np.outer(softness_slopes, force) + softness * force_slopes) / self.length
        lever = place - self.centre
        moments = _cross(place_slopes, force) + _cross(lever, force_slopes)
        turns = (softness_slopes * _cross(lever, force) + softness * moments) / self.inertia
        return shifts, np.asarray(turns)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])

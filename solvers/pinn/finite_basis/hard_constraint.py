"""The clamped base as a hard Dirichlet condition of a network."""

from dataclasses import dataclass

from geometry.mesh.triangle_mesh import TriangleMesh
from solvers.pinn.finite_basis.base_distance import BaseDistance, Points, base_distance


@dataclass(frozen=True)
class HardConstraint:
    """A hard Dirichlet condition: the factor d / (d + length) of the distance d to the base.

    With it u = 0 holds on the base for all weights, and on the base only.
    """

    distance: BaseDistance  # d, mm
    length: float  # Distance at which the factor is one half, mm

    @classmethod
    def of(cls, mesh: TriangleMesh, length: float) -> "HardConstraint":
        """The factor for a mesh."""
        return cls(base_distance(mesh), length)

    def at(self, points: Points) -> tuple[Points, Points, Points]:
        """The factor at points (n, 2), mm, and its derivatives by x and y, 1/mm, each (n, 1)."""
        distance, along_x, along_y = self.distance.at(points)
        slope = self.length / (distance + self.length) ** 2
        return distance / (distance + self.length), slope * along_x, slope * along_y

"""The clamped base as a hard Dirichlet condition of a network."""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import torch

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.mesh.triangle_mesh import TriangleMesh

Points = TypeVar("Points", torch.Tensor, FloatArray)


@dataclass(frozen=True)
class HardConstraint:
    """A hard Dirichlet condition: the factor d / (d + length) of the distance d to the base.

    With it u = 0 holds on the base for all weights.

    Attributes:
        base_x: The base is on the line x = base_x, mm.
        length: Distance at which the factor is one half, mm.
    """

    base_x: float
    length: float

    @classmethod
    def of(cls, mesh: TriangleMesh, length: float) -> "HardConstraint":
        """The factor for a mesh.

        Raises:
            UserError: If the base is not a straight edge x = constant with the body on its right.
        """
        x = mesh.points[np.unique(mesh.boundary("base")), 0]
        if np.ptp(x) > 1e-9 or mesh.points[:, 0].min() < x.min() - 1e-9:
            raise UserError(
                "the network's hard condition needs a base on a line x = constant, left of the body"
            )
        return cls(float(x.mean()), length)

    def at(self, points: Points) -> tuple[Points, Points]:
        """The factor and its derivative with respect to x, 1/mm, at points (n, 2), mm, each (n, 1)."""
        distance = points[:, :1] - self.base_x
        return distance / (distance + self.length), self.length / (distance + self.length) ** 2

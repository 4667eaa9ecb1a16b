"""Displacements that a network can have: its hidden units times a factor that vanishes on the base."""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import torch

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.locate import Location
from geometry.mesh import TriangleMesh
from solvers.pinn.gated_units import GatedUnits
from solvers.pinn.pieces import in_pieces

Points = TypeVar("Points", torch.Tensor, FloatArray)


@dataclass(frozen=True)
class BaseFactor:
    """The factor d / (d + length) of the distance d to the base, where u = 0 then holds whatever the weights.

    Attributes:
        abscissa: Where the base is, mm.
        length: Distance at which the factor is one half, mm.
    """

    abscissa: float
    length: float

    @classmethod
    def of(cls, mesh: TriangleMesh, length: float) -> "BaseFactor":
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
        """The factor and its slope along x, 1/mm, at points (n, 2), mm, each (n, 1): tensors or arrays."""
        distance = points[:, :1] - self.abscissa
        return distance / (distance + self.length), self.length / (distance + self.length) ** 2


@dataclass(frozen=True, eq=False)
class TrialUnits:
    """Hidden units times the base factor, evaluated in pieces.

    Attributes:
        units: The hidden units.
        factor: The hard condition.
    """

    units: GatedUnits
    factor: BaseFactor

    def values(self, points: torch.Tensor) -> torch.Tensor:
        """Values at points (n, 2), mm: (n, U)."""
        result = points.new_empty(len(points), self.units.count)

        def task(rows: slice) -> None:
            result[rows] = self.values_of_piece(points[rows])

        in_pieces(task, len(points), self.units.count)
        return result

    def derivatives(self, points: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Derivatives along x and y at points (n, 2), mm, each (n, U), 1/mm."""
        along_x, along_y = (points.new_empty(len(points), self.units.count) for _ in range(2))

        def task(rows: slice) -> None:
            along_x[rows], along_y[rows] = self.derivatives_of_piece(points[rows])

        in_pieces(task, len(points), self.units.count)
        return along_x, along_y

    def values_of_piece(self, points: torch.Tensor) -> torch.Tensor:
        """`values` for a few points, in the calling thread."""
        return self.units.values(points).mul_(self.factor.at(points)[0])

    def derivatives_of_piece(self, points: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """`derivatives` for a few points, in the calling thread."""
        factor, slope = self.factor.at(points)
        value, value_x, value_y = self.units.with_derivatives(points)
        return value_x.mul_(factor).add_(value.mul_(slope)), value_y.mul_(factor)


@dataclass(frozen=True, eq=False)
class NetworkField:
    """A trained network as a displacement field.

    Attributes:
        trial: Hidden layers and the hard condition.
        output: Output layer, shape (U, 2), mm.
    """

    trial: TrialUnits
    output: torch.Tensor

    def displacement(self, location: Location) -> FloatArray:
        """Displacement, shape (n, 2), mm."""
        points = torch.from_numpy(np.array(location.points))
        result = points.new_empty(len(points), 2)

        def task(rows: slice) -> None:
            torch.mm(self.trial.values_of_piece(points[rows]), self.output, out=result[rows])

        in_pieces(task, len(points), len(self.output))
        return np.asarray(result.numpy())

    def gradient(self, location: Location) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 2, 2)."""
        points = torch.from_numpy(np.array(location.points))
        result = points.new_empty(len(points), 2, 2)

        def task(rows: slice) -> None:
            for axis, derivative in enumerate(self.trial.derivatives_of_piece(points[rows])):
                result[rows, :, axis] = derivative @ self.output

        in_pieces(task, len(points), len(self.output))
        return np.asarray(result.numpy())

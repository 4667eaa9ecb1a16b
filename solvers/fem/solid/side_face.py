"""The displacement of a side face, or of the middle plane, as a field on the shared mesh."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from geometry.arrays import FloatArray
from geometry.mesh.point_location import LocatedPoints
from solvers.fem.solid.extrusion import ExtrudedSpace
from solvers.lagrange import LagrangeSpace

Face = Literal["side", "middle"]


@dataclass(frozen=True, eq=False)
class FaceField:
    """A plane z = constant of a displacement in three dimensions; it is a `SolidField`.

    Attributes:
        space: Quadratic elements on the section.
        values: Nodal displacements, shape (P, 3), mm.
        slopes: Their derivatives along z, shape (P, 3).
    """

    space: LagrangeSpace
    values: FloatArray
    slopes: FloatArray

    @classmethod
    def of(cls, space: ExtrudedSpace, nodal: FloatArray, face: Face) -> "FaceField":
        """The field of a face, or of the middle plane, of nodal displacements (N, 3), mm.

        The derivative along z is that of the parabola through the three nodes of a layer above each other. In
        the middle plane symmetry leaves only that of u_z.
        """
        levels = [-1, -2, -3] if face == "side" else [0, 1, 2]
        own, half, whole = (space.at_level(nodal, level) for level in levels)
        height = space.levels[levels[2]] - space.levels[levels[0]]
        slopes = (-3 * own + 4 * half - whole) / height
        if face == "middle":
            slopes[:, :2] = 0.0
        return cls(space.section, own, slopes)

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement in the plane, shape (n, 2), mm."""
        return np.asarray(self.space.shape_functions(location) @ self.values[:, :2])

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j in the plane, shape (n, 2, 2)."""
        return self.solid_gradient(location)[:, :2, :2]

    def solid_gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 3, 3)."""
        dx, dy = self.space.shape_gradients(location)
        dz = self.space.shape_functions(location) @ self.slopes
        return np.stack([dx @ self.values, dy @ self.values, dz], axis=-1)

"""The displacement of a side face, or of the middle plane, as a field on the shared mesh."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from geometry.arrays import FloatArray
from geometry.mesh.point_location import LocatedPoints
from solvers.extrusion import ExtrudedSpace

Face = Literal["side", "middle"]


@dataclass(frozen=True, eq=False)
class FaceField:
    """A plane z = constant of a displacement in three dimensions; it is a `SolidField`."""

    space: ExtrudedSpace  # Quadratic elements on half of the body
    nodal: FloatArray  # Nodal displacements, shape (N, 3), mm
    face: Face  # The "side" face or the "middle" plane

    @cached_property
    def values(self) -> FloatArray:
        """Displacements of the plane's nodes, shape (P, 3), mm."""
        return self.space.at_level(self.nodal, -1 if self.face == "side" else 0)

    @cached_property
    def slopes(self) -> FloatArray:
        """Their derivatives along z, shape (P, 3), by a parabola through the three nodes of a layer.

        In the middle plane symmetry leaves only that of u_z.
        """
        levels = [-1, -2, -3] if self.face == "side" else [0, 1, 2]
        own, half, whole = (self.space.at_level(self.nodal, level) for level in levels)
        height = self.space.levels[levels[2]] - self.space.levels[levels[0]]
        slopes = (-3 * own + 4 * half - whole) / height
        if self.face == "middle":
            slopes[:, :2] = 0.0
        return np.asarray(slopes)

    def on(self, face: Face) -> "FaceField":
        """Another plane of the same displacement."""
        return replace(self, face=face)

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement in the plane, shape (n, 2), mm."""
        return np.asarray(self.space.section.shape_functions(location) @ self.values[:, :2])

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j in the plane, shape (n, 2, 2)."""
        return self.solid_gradient(location)[:, :2, :2]

    def solid_gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 3, 3)."""
        dx, dy = self.space.section.shape_gradients(location)
        dz = self.space.section.shape_functions(location) @ self.slopes
        return np.stack([dx @ self.values, dy @ self.values, dz], axis=-1)

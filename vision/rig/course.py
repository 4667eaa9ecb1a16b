"""The finger's displacement on the way from rest to the full load."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from geometry.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Course:
    """Nodal displacements at shares of the load, joined by a cubic spline.

    Attributes:
        shares: From 0 to 1, ascending, shape (k,).
        displacements: Of the mesh's nodes, shape (k, n, 2), mm.
    """

    shares: FloatArray
    displacements: FloatArray

    @classmethod
    def proportional(cls, displacement: FloatArray) -> "Course":
        """Displacements that grow in proportion to the load to those of shape (n, 2), mm."""
        return cls(np.array([0.0, 1.0]), np.stack([np.zeros_like(displacement), displacement]))

    def at(self, share: float) -> FloatArray:
        """Displacements at a share of the load, shape (n, 2), mm."""
        return np.asarray(self._spline(share))

    @cached_property
    def _spline(self) -> CubicSpline:
        return CubicSpline(self.shares, self.displacements)

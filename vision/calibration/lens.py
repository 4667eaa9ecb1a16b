"""Lens models: distortion of points on the plane at depth 1 in front of the camera.

`BrownLens` is radial and tangential distortion (D. C. Brown, "Close-range camera calibration",
Photogrammetric Engineering 37, 1971). `FisheyeLens` is for angles of view beyond about 100 degrees: a
polynomial in the angle to the axis (J. Kannala, S. S. Brandt, "A generic camera model and calibration method
for conventional, wide-angle, and fish-eye lenses", IEEE TPAMI 28, 2006, eq. 6). Both have OpenCV's
coefficients. No units: a point of the plane is (x / z, y / z).
"""

from dataclasses import dataclass

import numpy as np

from geometry.arrays import FloatArray


@dataclass(frozen=True)
class BrownLens:
    """Radial coefficients k1, k2, k3 and tangential p1, p2."""

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0

    def distort(self, plane: FloatArray) -> FloatArray:
        """Distorted points; shapes (n, 2)."""
        x, y = plane.T
        s = x**2 + y**2
        radial = 1 + s * (self.k1 + s * (self.k2 + s * self.k3))
        bent_x = x * radial + 2 * self.p1 * x * y + self.p2 * (s + 2 * x**2)
        bent_y = y * radial + self.p1 * (s + 2 * y**2) + 2 * self.p2 * x * y
        return np.stack([bent_x, bent_y], axis=1)

    def jacobian(self, plane: FloatArray) -> FloatArray:
        """Derivative of `distort` by the points, shape (n, 2, 2)."""
        x, y = plane.T
        s = x**2 + y**2
        radial = 1 + s * (self.k1 + s * (self.k2 + s * self.k3))
        steepness = self.k1 + s * (2 * self.k2 + 3 * s * self.k3)
        mixed = 2 * x * y * steepness + 2 * (self.p1 * x + self.p2 * y)
        along_x = radial + 2 * x**2 * steepness + 2 * self.p1 * y + 6 * self.p2 * x
        along_y = radial + 2 * y**2 * steepness + 6 * self.p1 * y + 2 * self.p2 * x
        return np.asarray(np.stack([along_x, mixed, mixed, along_y], axis=1).reshape(-1, 2, 2))

    def by_coefficients(self, plane: FloatArray) -> FloatArray:
        """Derivative of `distort` by k1, k2, p1, p2, k3, shape (n, 2, 5)."""
        x, y = plane.T
        s = x**2 + y**2
        along_x = [x * s, x * s**2, 2 * x * y, s + 2 * x**2, x * s**3]
        along_y = [y * s, y * s**2, s + 2 * y**2, 2 * x * y, y * s**3]
        return np.moveaxis(np.array([along_x, along_y]), 2, 0)


@dataclass(frozen=True)
class FisheyeLens:
    """θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸) is the distance from the axis of a ray at the angle θ to it."""

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0

    def distort(self, plane: FloatArray) -> FloatArray:
        """Distorted points; shapes (n, 2)."""
        return np.asarray(plane * self._scale(_radius(plane))[:, None])

    def jacobian(self, plane: FloatArray) -> FloatArray:
        """Derivative of `distort` by the points, shape (n, 2, 2)."""
        r = _radius(plane)
        s = np.arctan(r) ** 2
        growth = 1 + s * (3 * self.k1 + s * (5 * self.k2 + s * (7 * self.k3 + s * 9 * self.k4)))
        steepness = (growth / (1 + r**2) - self._scale(r)) / r**2
        outer = plane[:, :, None] * plane[:, None, :]
        return np.asarray(self._scale(r)[:, None, None] * np.eye(2) + steepness[:, None, None] * outer)

    def by_coefficients(self, plane: FloatArray) -> FloatArray:
        """Derivative of `distort` by k1, k2, k3, k4, shape (n, 2, 4)."""
        r = _radius(plane)
        powers = np.arctan(r)[:, None] ** (3, 5, 7, 9) / r[:, None]
        return np.asarray(plane[:, :, None] * powers[:, None, :])

    def _scale(self, r: FloatArray) -> FloatArray:
        """Distance from the axis after the lens over the one before, r."""
        angle = np.arctan(r)
        s = angle**2
        return np.asarray(angle / r * (1 + s * (self.k1 + s * (self.k2 + s * (self.k3 + s * self.k4)))))


Lens = BrownLens | FisheyeLens
LENSES: dict[str, type[Lens]] = {"brown": BrownLens, "fisheye": FisheyeLens}
"""By the name of the model."""


def _radius(plane: FloatArray) -> FloatArray:
    """Distance from the axis, shape (n,); 1e-8 instead of zero, where the formulas are limits."""
    return np.maximum(np.hypot(plane[:, 0], plane[:, 1]), 1e-8)

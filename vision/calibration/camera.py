"""Camera model: projection of points to pixels with lens distortion, and removal of the distortion.

A pinhole behind one of the lenses of `vision.calibration.lens`, in the convention of OpenCV: x to the right,
y down, z away from the camera; the centre of the first pixel is (0, 0).
Units: mm in space, pixels in the image.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike

from geometry.arrays import FloatArray
from geometry.errors import UserError
from vision.calibration.lens import LENSES, Lens

NEWTON_STEPS = 60
NEWTON_TOLERANCE = 1e-10
"""Pixels."""


class Pose(NamedTuple):
    """Pose in the camera's frame: a rotation vector (axis times angle) and a shift, mm."""

    rotation: FloatArray
    translation: FloatArray


IDENTITY = Pose(np.zeros(3), np.zeros(3))


class Projection(NamedTuple):
    """Pixels of points, and their derivatives.

    Attributes:
        pixels: Shape (n, 2).
        by_point: Derivative by the points in the camera's frame, shape (n, 2, 3), pixels per mm.
        by_intrinsics: Derivative by the camera's `intrinsics`, shape (n, 2, intrinsics).
    """

    pixels: FloatArray
    by_point: FloatArray
    by_intrinsics: FloatArray


@dataclass(frozen=True)
class Camera:
    """A calibrated camera.

    Attributes:
        width, height: Of its images, pixels.
        fx, fy: Focal lengths, pixels.
        cx, cy: Principal point, pixels.
        distortion: Coefficients of the lens: k1, k2, p1, p2, k3 of "brown"; k1, k2, k3, k4 of "fisheye".
        model: Name of the lens in `vision.calibration.lens.LENSES`.
        covariance: Of `intrinsics`, in rows; None if it is not known.

    Raises:
        UserError: If a number is not finite, a size or a focal length is not above zero, or there are more or
            fewer coefficients than the lens has.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = (0.0,) * 5
    model: str = "brown"
    covariance: tuple[tuple[float, ...], ...] | None = None

    def __post_init__(self) -> None:
        if self.model not in LENSES:
            raise UserError(f"no lens model is called {self.model!r}; there are: {', '.join(LENSES)}")
        coefficients = self.intrinsic_names[4:]
        if len(self.distortion) != len(coefficients):
            raise UserError(
                f"distortion has {len(self.distortion)} numbers; for the model {self.model} it must have "
                f"{', '.join(coefficients)}"
            )
        if not np.isfinite([*self.matrix.ravel(), *self.distortion]).all():
            raise UserError("a camera holds a number that is not finite")
        for name in ("width", "height", "fx", "fy"):
            if (value := getattr(self, name)) <= 0:
                raise UserError(f"the camera's {name} is {value:g}; it must be above zero")
        if self.covariance is not None:
            _check_covariance(np.array(self.covariance, dtype=np.float64), self.intrinsic_names)

    @cached_property
    def lens(self) -> Lens:
        """The lens with its coefficients."""
        return LENSES[self.model](*self.distortion)

    @property
    def intrinsic_names(self) -> tuple[str, ...]:
        """Names of `intrinsics`: fx, fy, cx, cy and the coefficients of the lens."""
        return ("fx", "fy", "cx", "cy", *(field.name for field in fields(LENSES[self.model])))

    @property
    def intrinsics(self) -> FloatArray:
        """Focal lengths and principal point, pixels, and the coefficients of the lens."""
        return np.array([self.fx, self.fy, self.cx, self.cy, *self.distortion], dtype=np.float64)

    @property
    def standard_deviations(self) -> tuple[float, ...] | None:
        """Of `intrinsics`; None if they are not known."""
        return None if self.covariance is None else tuple(np.sqrt(np.diag(self.covariance)).tolist())

    @property
    def matrix(self) -> FloatArray:
        """The matrix of the intrinsics, shape (3, 3), pixels."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1]], dtype=np.float64)

    def with_intrinsics(self, values: Sequence[float] | FloatArray) -> "Camera":
        """The camera with other `intrinsics`, of unknown covariance."""
        fx, fy, cx, cy, *distortion = map(float, values)
        return replace(self, fx=fx, fy=fy, cx=cx, cy=cy, distortion=tuple(distortion), covariance=None)

    def project(self, points: ArrayLike, pose: Pose = IDENTITY) -> FloatArray:
        """Project points to pixels.

        Args:
            points: Shape (n, 3), mm, in the frame whose pose is `pose`.
            pose: Of the points' frame in the camera's.

        Returns:
            Shape (n, 2), pixels.

        Raises:
            UserError: If a point is not in front of the camera.
        """
        points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        rotation = np.asarray(cv2.Rodrigues(pose.rotation)[0], dtype=np.float64)
        return self._pixels(self.lens.distort(_plane(points @ rotation.T + pose.translation)))

    def project_with_jacobians(self, points: ArrayLike) -> Projection:
        """Project points in the camera's frame, shape (n, 3), mm, with derivatives by points and intrinsics.

        Raises:
            UserError: If a point is not in front of the camera.
        """
        points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        plane = _plane(points)
        bent = self.lens.distort(plane)
        by_plane = np.array([[self.fx], [self.fy]]) * self.lens.jacobian(plane)
        along_ray = -np.einsum("nij,nj->ni", by_plane, plane)
        by_point = np.concatenate([by_plane, along_ray[:, :, None]], axis=2) / points[:, 2, None, None]
        return Projection(self._pixels(bent), by_point, self._by_intrinsics(plane, bent))

    def distort(self, pixels: ArrayLike) -> FloatArray:
        """Pixels of a pinhole camera to pixels behind the lens; shapes (n, 2)."""
        return self._pixels(self.lens.distort(self._on_plane(pixels)))

    def undistort(self, pixels: ArrayLike) -> FloatArray:
        """Pixels behind the lens to pixels of a pinhole camera, the inverse of `distort`; shapes (n, 2).

        Newton's method on every point, to 1e-10 pixels.

        Raises:
            UserError: If a point lies where the distortion cannot be undone: the polynomial folds there.
        """
        bent = self._on_plane(pixels)
        plane, tolerance = bent.copy(), NEWTON_TOLERANCE / max(self.fx, self.fy)
        for _ in range(NEWTON_STEPS):
            missed, jacobian = self.lens.distort(plane) - bent, self.lens.jacobian(plane)
            upright = np.linalg.det(jacobian) > 0
            if not upright.all() or np.abs(missed).max(initial=0) < tolerance:
                break
            plane -= np.linalg.solve(jacobian, missed[:, :, None])[:, :, 0]
        folded = ~(upright & (np.abs(missed) < 10 * tolerance).all(axis=1))
        if folded.any():
            x, y = self._pixels(bent)[folded][0]
            raise UserError(
                f"the lens distortion cannot be undone at pixel ({x:.1f}, {y:.1f}); calibrate the camera "
                "with boards that reach the corners of the image"
            )
        return self._pixels(plane)

    def _on_plane(self, pixels: ArrayLike) -> FloatArray:
        """Points of the plane at depth 1 that a pinhole shows at `pixels`; shapes (n, 2)."""
        pixels = np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
        return np.asarray((pixels - (self.cx, self.cy)) / (self.fx, self.fy))

    def _pixels(self, plane: FloatArray) -> FloatArray:
        """The inverse of `_on_plane`."""
        return np.asarray(plane * (self.fx, self.fy) + (self.cx, self.cy))

    def _by_intrinsics(self, plane: FloatArray, bent: FloatArray) -> FloatArray:
        """Derivative of pixels by the intrinsics, shape (n, 2, intrinsics), at points before the lens."""
        zero, one = np.zeros(len(bent)), np.ones(len(bent))
        by_pinhole = [[bent[:, 0], zero, one, zero], [zero, bent[:, 1], zero, one]]
        by_lens = np.array([[self.fx], [self.fy]]) * self.lens.by_coefficients(plane)
        return np.concatenate([np.array(by_pinhole).transpose(2, 0, 1), by_lens], axis=2)


def _plane(points: FloatArray) -> FloatArray:
    """Intersections of the rays to points, shape (n, 3), with the plane at depth 1, shape (n, 2)."""
    behind = ~(points[:, 2] > 0)
    if behind.any():
        raise UserError(f"{behind.sum()} of {len(points)} points are not in front of the camera")
    return np.asarray(points[:, :2] / points[:, 2:])


def _check_covariance(covariance: FloatArray, names: tuple[str, ...]) -> None:
    size = len(names)
    if covariance.shape != (size, size) or not (np.diag(covariance) >= 0).all():
        raise UserError(
            f"the covariance must be {size} rows of {size} numbers, its diagonal from 0: {', '.join(names)}"
        )
    if not (np.isfinite(covariance).all() and np.array_equal(covariance, covariance.T)):
        raise UserError("the covariance of the intrinsics must be finite and symmetric")

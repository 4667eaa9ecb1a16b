"""Camera model: projection of points to pixels with lens distortion, and removal of the distortion.

A pinhole behind a lens, by OpenCV: x to the right, y down, z away from the camera; the centre of the first
pixel is (0, 0). The lens has radial and tangential distortion (D. C. Brown, "Close-range camera calibration",
Photogrammetric Engineering 37, 1971), which serves up to angles of view of about 100 degrees.
Units: mm in space, pixels in the image.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError

INTRINSICS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
"""Names of a camera's `intrinsics`: focal lengths, principal point, distortion."""


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
        by_intrinsics: Derivative by the camera's `intrinsics`, shape (n, 2, 9).
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
        distortion: Coefficients of the lens: k1, k2, p1, p2, k3.
        covariance: Of `intrinsics`, in rows; None if it is not known.

    Raises:
        UserError: If a number is not finite, a size or a focal length is not above zero, or there are not
            five coefficients.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = (0.0,) * 5
    covariance: tuple[tuple[float, ...], ...] | None = None

    def __post_init__(self) -> None:
        if len(self.distortion) != len(INTRINSICS[4:]):
            raise UserError(
                f"distortion has {len(self.distortion)} numbers; it must have {', '.join(INTRINSICS[4:])}"
            )
        if not np.isfinite([*self.matrix.ravel(), *self.distortion]).all():
            raise UserError("a camera holds a number that is not finite")
        for name in ("width", "height", "fx", "fy"):
            if (value := getattr(self, name)) <= 0:
                raise UserError(f"the camera's {name} is {value:g}; it must be above zero")
        if self.covariance is not None:
            _check_covariance(np.array(self.covariance, dtype=np.float64))

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
        return self.project_with_jacobians(points @ rotation.T + pose.translation).pixels

    def project_with_jacobians(self, points: ArrayLike) -> Projection:
        """Project points in the camera's frame, shape (n, 3), mm, with derivatives by points and intrinsics.

        Raises:
            UserError: If a point is not in front of the camera.
        """
        points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        behind = ~(points[:, 2] > 0)
        if behind.any():
            raise UserError(f"{behind.sum()} of {len(points)} points are not in front of the camera")
        if not (count := len(points)):
            return Projection(np.empty((0, 2)), np.empty((0, 2, 3)), np.empty((0, 2, len(INTRINSICS))))
        pixels, derivatives = cv2.projectPoints(
            points[:, None], *IDENTITY, self.matrix, np.array(self.distortion)
        )
        # OpenCV's columns: rotation, shift, f, c, distortion.
        by_all = np.asarray(derivatives, dtype=np.float64).reshape(count, 2, -1)
        seen = np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
        return Projection(seen, by_all[:, :, 3:6], by_all[:, :, 6:])

    def undistort(self, pixels: ArrayLike) -> FloatArray:
        """Pixels behind the lens to pixels of a pinhole camera; shapes (n, 2).

        Newton's method on every point, to 1e-10 pixels; OpenCV's own inverse does not notice a fold.

        Raises:
            UserError: If a point lies where the distortion cannot be undone: the polynomial folds there.
        """
        seen = np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
        plane = (seen - (self.cx, self.cy)) / (self.fx, self.fy)
        tolerance = 1e-10
        for _ in range(60):
            bent = self.project_with_jacobians(np.column_stack([plane, np.ones(len(plane))]))
            missed, jacobian = bent.pixels - seen, bent.by_point[:, :, :2]
            upright = np.linalg.det(jacobian) > 0
            if not upright.all() or np.abs(missed).max(initial=0) < tolerance:
                break
            plane -= np.linalg.solve(jacobian, missed[:, :, None])[:, :, 0]
        folded = ~(upright & (np.abs(missed) < 10 * tolerance).all(axis=1))
        if folded.any():
            x, y = seen[folded][0]
            raise UserError(
                f"the lens distortion cannot be undone at pixel ({x:.1f}, {y:.1f}); calibrate the camera "
                "with boards that reach the corners of the image"
            )
        return np.asarray(plane * (self.fx, self.fy) + (self.cx, self.cy))


def _check_covariance(covariance: FloatArray) -> None:
    size = len(INTRINSICS)
    if covariance.shape != (size, size) or not (np.diag(covariance) >= 0).all():
        raise UserError(
            f"the covariance must be {size} rows of {size} numbers, its diagonal from 0: "
            + ", ".join(INTRINSICS)
        )
    if not (np.isfinite(covariance).all() and np.array_equal(covariance, covariance.T)):
        raise UserError("the covariance of the intrinsics must be finite and symmetric")

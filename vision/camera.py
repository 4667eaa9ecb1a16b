"""A camera: how points in space become pixels, and how the distortion of its lens is undone.

Pinhole with radial and tangential distortion (D. C. Brown, "Close-range camera calibration", Photogrammetric
Engineering 37, 1971), in the convention of OpenCV: x to the right, y down, z away from the camera; the centre
of the first pixel is (0, 0). Units: mm in space, pixels in the image.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike

from geometry.arrays import FloatArray
from geometry.atomic import atomic_path
from geometry.errors import UserError

FORMATS = (".json", ".yml", ".yaml")
INTRINSICS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
NEWTON_STEPS = 30
NEWTON_TOLERANCE = 1e-10
"""Pixels."""


class Pose(NamedTuple):
    """Where something is in the camera's frame: a rotation vector (axis times angle) and a shift, mm."""

    rotation: FloatArray
    translation: FloatArray


IN_FRONT = Pose(np.zeros(3), np.zeros(3))


@dataclass(frozen=True)
class Camera:
    """A calibrated camera.

    Attributes:
        width, height: Of its images, pixels.
        fx, fy: Focal lengths, pixels.
        cx, cy: Principal point, pixels.
        distortion: k1, k2, p1, p2, k3.
        standard_deviations: Of fx, fy, cx, cy, k1, k2, p1, p2, k3; None if they are not known.

    Raises:
        UserError: If a number is not finite, or a size or a focal length is not above zero.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = (0.0,) * 5
    standard_deviations: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if len(self.distortion) != 5:
            raise UserError(f"distortion has {len(self.distortion)} numbers; it must have k1, k2, p1, p2, k3")
        deviations = self.standard_deviations or (0.0,) * len(INTRINSICS)
        if len(deviations) != len(INTRINSICS) or not all(value >= 0 for value in deviations):
            raise UserError(
                f"the standard deviations must be {len(INTRINSICS)} numbers from 0: {', '.join(INTRINSICS)}"
            )
        if not np.isfinite([*self.matrix.ravel(), *self.distortion, *deviations]).all():
            raise UserError("a camera holds a number that is not finite")
        for name in ("width", "height", "fx", "fy"):
            if (value := getattr(self, name)) <= 0:
                raise UserError(f"the camera's {name} is {value:g}; it must be above zero")

    @property
    def matrix(self) -> FloatArray:
        """The matrix of the intrinsics, shape (3, 3), pixels."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1]], dtype=np.float64)

    def project(self, points: ArrayLike, pose: Pose = IN_FRONT) -> FloatArray:
        """Where points are seen.

        Args:
            points: Shape (n, 3), mm, in the camera's frame or in the one that `pose` puts there.
            pose: Of the points' frame in the camera's.

        Returns:
            Shape (n, 2), pixels.

        Raises:
            UserError: If a point is not in front of the camera.
        """
        points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        depth = points @ cv2.Rodrigues(pose.rotation)[0][2] + pose.translation[2]
        if (depth <= 0).any():
            raise UserError(f"{(depth <= 0).sum()} of {len(points)} points are not in front of the camera")
        return self._project(points, pose)[0]

    def distort(self, pixels: ArrayLike) -> FloatArray:
        """Where the lens puts points that a pinhole would show at `pixels`; shapes (n, 2), pixels."""
        return self._project(self._rays(pixels))[0]

    def undistort(self, pixels: ArrayLike) -> FloatArray:
        """Where a pinhole would show what the lens puts at `pixels`: the inverse of `distort`.

        Newton's method on every point until it is met within 1e-10 pixels.

        Args:
            pixels: Shape (n, 2), pixels.

        Returns:
            Shape (n, 2), pixels.

        Raises:
            UserError: If a point lies where the distortion cannot be undone: the polynomial folds there.
        """
        pixels = np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
        rays = self._rays(pixels)
        for _ in range(NEWTON_STEPS):
            seen, slope = self._project(rays)
            missed = seen - pixels
            if not (np.linalg.det(slope) > 0).all() or np.abs(missed).max(initial=0) < NEWTON_TOLERANCE:
                break
            rays[:, :2] -= np.linalg.solve(slope, missed[:, :, None])[:, :, 0]
        folded = ~((np.linalg.det(slope) > 0) & (np.abs(missed) < 10 * NEWTON_TOLERANCE).all(axis=1))
        if folded.any():
            x, y = pixels[folded][0]
            raise UserError(
                f"the lens distortion cannot be undone at pixel ({x:.1f}, {y:.1f}); calibrate the camera "
                "with boards that reach the corners of the image"
            )
        return np.asarray(rays @ self.matrix[:2].T)

    def _rays(self, pixels: ArrayLike) -> FloatArray:
        """Points at depth 1 that a pinhole shows at `pixels`, shape (n, 3)."""
        plane = (np.asarray(pixels).reshape(-1, 2) - (self.cx, self.cy)) / (self.fx, self.fy)
        return np.column_stack([plane, np.ones(len(plane))])

    def _project(self, points: FloatArray, pose: Pose = IN_FRONT) -> tuple[FloatArray, FloatArray]:
        """Pixels, shape (n, 2), and their derivatives by x and y in the camera's frame, (n, 2, 2)."""
        if not len(points):
            return np.empty((0, 2)), np.empty((0, 2, 2))
        pixels, jacobian = cv2.projectPoints(points, *pose, self.matrix, np.array(self.distortion))
        slope = np.asarray(jacobian[:, 3:5], np.float64).reshape(-1, 2, 2)
        return np.asarray(pixels, np.float64)[:, 0], slope


def save_camera(path: Path, camera: Camera) -> None:
    """Write a camera atomically, as JSON or YAML by the suffix, under the names of OpenCV's samples.

    `cv2.FileStorage` reads both; `load_camera` gives the same camera back.

    Raises:
        UserError: If the suffix is none of `FORMATS`.
    """
    check_format(path)
    storage = cv2.FileStorage(path.suffix.lower(), cv2.FileStorage_WRITE | cv2.FileStorage_MEMORY)
    storage.write("image_width", camera.width)
    storage.write("image_height", camera.height)
    storage.write("camera_matrix", camera.matrix)
    storage.write("distortion_coefficients", np.array([camera.distortion]))
    if camera.standard_deviations is not None:
        storage.write("intrinsics_standard_deviations", np.array([camera.standard_deviations]))
    with atomic_path(path) as partial:
        partial.write_text(storage.releaseAndGetString(), encoding="utf-8")


def load_camera(path: Path) -> Camera:
    """Read a camera that `save_camera`, or OpenCV's calibration sample, wrote.

    Raises:
        UserError: If the file cannot be read, a key is missing or its value is of another kind.
    """
    try:
        text = path.read_text(encoding="utf-8")
        storage = cv2.FileStorage(text, cv2.FileStorage_READ | cv2.FileStorage_MEMORY)
    except OSError as error:
        raise UserError(f"cannot read the camera {path}: {error.strerror}") from None
    except (UnicodeDecodeError, cv2.error, SystemError):
        raise UserError(
            f"cannot read the camera {path}: it is not JSON or YAML as OpenCV writes it"
        ) from None
    if storage.getNode("fisheye_model").real():
        raise UserError(f"{path} has fisheye_model 1; only the model with k1, k2, p1, p2, k3 is known")
    width, height = (_number(storage, name, path) for name in ("image_width", "image_height"))
    matrix = _matrix(storage, "camera_matrix", path, sizes=(9,)).reshape(3, 3)
    distortion = _matrix(storage, "distortion_coefficients", path, sizes=(4, 5))
    known = not storage.getNode("intrinsics_standard_deviations").empty()
    deviations = _matrix(storage, "intrinsics_standard_deviations", path, sizes=(9,)) if known else None
    try:
        return Camera(
            width=width,
            height=height,
            fx=float(matrix[0, 0]),
            fy=float(matrix[1, 1]),
            cx=float(matrix[0, 2]),
            cy=float(matrix[1, 2]),
            distortion=tuple(np.resize([*distortion, 0.0], 5).tolist()),
            standard_deviations=None if deviations is None else tuple(deviations.tolist()),
        )
    except UserError as error:
        raise UserError(f"{path}: {error}") from None


def check_format(path: Path) -> None:
    """Raise `UserError` unless the suffix says how to write a camera."""
    if path.suffix.lower() not in FORMATS:
        raise UserError(f"{path}: a camera is written as {', '.join(FORMATS)}; give a name that ends so")


def _number(storage: cv2.FileStorage, name: str, path: Path) -> int:
    node = storage.getNode(name)
    if not node.isInt():
        raise UserError(f"{path}: {name} is {'missing' if node.empty() else 'no whole number'}; give pixels")
    return int(node.real())


def _matrix(storage: cv2.FileStorage, name: str, path: Path, *, sizes: tuple[int, ...]) -> FloatArray:
    """The entries of a matrix, whose number must be one of `sizes`."""
    node = storage.getNode(name)
    what = f"a matrix of {' or '.join(map(str, sizes))} numbers"
    if node.empty():
        raise UserError(f"{path}: {name} is missing; it must be {what}")
    try:
        values = np.asarray(node.mat(), dtype=np.float64).ravel()
    except (cv2.error, SystemError, TypeError):
        values = np.empty(0)
    if len(values) not in sizes:
        raise UserError(f"{path}: {name} is not {what}")
    return values

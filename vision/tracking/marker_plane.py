"""Maps from pixels to the markers' plane and back, with covariances.

A plane's projection has a few parameters: pose and intrinsics of a calibrated camera, the eight of a
homography, or the four of a similarity. They are fitted to the fiducials, and their errors shift all markers
alike: in a displacement most of that cancels, because both of its ends go through the same parameters.
Covariances come from linear propagation of covariances by the implicit function theorem (R. Hartley,
A. Zisserman, "Multiple View Geometry", 2nd ed., 2003, chapter 5). Units: pixels, mm.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import cv2
import numpy as np

from pinnray.geometry.picture_frame import Homography
from pinnray.runtime.arrays import FloatArray
from pinnray.vision.calibration.camera import Camera, Pose

CORNERS = 24
"""Number of corners of the polygon that approximates a circle."""


class Jacobians(NamedTuple):
    """Derivatives of pixels: by the point in the plane, (n, 2, 2), and by the parameters, (n, 2, k)."""

    point: FloatArray
    parameters: FloatArray


class PlaneProjection(Protocol):
    """Projection of a plane to pixels; `parameters` has shape (k,)."""

    def pixels(self, points: FloatArray, parameters: FloatArray) -> FloatArray:
        """Project points of the plane, shape (n, 2), mm, to pixels, shape (n, 2)."""

    def points(self, pixels: FloatArray, parameters: FloatArray) -> FloatArray:
        """The inverse of `pixels`."""

    def jacobians(self, points: FloatArray, parameters: FloatArray) -> Jacobians:
        """Derivatives of `pixels`."""


@dataclass(frozen=True, eq=False)
class MarkerPlane:
    """The markers' plane and its projection to pixels.

    Attributes:
        projection: To pixels.
        parameters: Shape (k,).
        covariance: Of the parameters, shape (k, k).
        residual: Root mean square residual of the fiducials, mm.
        bending: Standard deviation of a displacement's error over the displacement, by a lens that the
            projection leaves out.
    """

    projection: PlaneProjection
    parameters: FloatArray
    covariance: FloatArray
    residual: float
    bending: float = 0.0

    @property
    def on_sheet(self) -> "MarkerPlane":
        """The plane of the fiducials, which the markers of a camera may be above."""
        if not isinstance(self.projection, CameraProjection):
            return self
        return replace(self, projection=replace(self.projection, height=0.0))

    def points(self, pixels: FloatArray) -> FloatArray:
        """Points of the plane at pixels; shapes (n, 2), mm."""
        return self.projection.points(pixels, self.parameters)

    def pixels(self, points: FloatArray) -> FloatArray:
        """Project points of the plane; shapes (n, 2), pixels."""
        return self.projection.pixels(points, self.parameters)

    def circles(self, pixels: FloatArray, radius: float) -> FloatArray:
        """Centres of circles in the plane, shape (..., 2), mm, from those of their images; nan stays nan."""
        flat = pixels.reshape(-1, 2)
        known = np.isfinite(flat).all(axis=1)
        seen, centres = flat[known], np.full_like(flat, np.nan)
        centres[known] = self.points(seen - self.beside(self.points(seen), radius))
        return centres.reshape(pixels.shape)

    def beside(self, centres: FloatArray, radius: float) -> FloatArray:
        """Offsets of the images of circles from the images of their centres, shape (n, 2), pixels.

        They differ by perspective and lens. The place of an image is the centroid of its area, as for an
        ellipse its centre.
        """
        angles = 2 * np.pi * np.arange(CORNERS) / CORNERS
        reach = radius * np.sqrt(angles[1] / np.sin(angles[1]))  # the polygon has the circle's area
        around = reach * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        seen = self.pixels((centres[:, None] + around).reshape(-1, 2)).reshape(-1, CORNERS, 2)
        x, y = np.moveaxis(seen - self.pixels(centres)[:, None], 2, 0)
        turns = x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)
        middle = [((of + np.roll(of, -1, axis=1)) * turns).sum(axis=1) for of in (x, y)]
        return np.asarray(np.stack(middle, axis=1) / (3 * turns.sum(axis=1)[:, None]))

    def aligned(self, homography: Homography) -> "MarkerPlane":
        """The plane in the frame to which a homography takes its points."""
        return replace(self, projection=AlignedProjection(self.projection, homography))

    def scales(self, points: FloatArray) -> FloatArray:
        """Pixels per mm at points of the plane, shape (n,): the root of the ratio of areas."""
        by_point = self.projection.jacobians(points, self.parameters).point
        return np.asarray(np.sqrt(np.abs(np.linalg.det(by_point))))

    def displacement_covariance(
        self, initial: FloatArray, final: FloatArray, initial_noise: FloatArray, final_noise: FloatArray
    ) -> FloatArray:
        """Covariance of the displacements of m points, shape (2 m, 2 m), mm², in the order u1, v1, u2, ...

        Args:
            initial: Initial positions in the plane, shape (m, 2), mm.
            final: Final ones.
            initial_noise: Covariances of the initial pixels, shape (m, 2, 2), pixels².
            final_noise: Of the final ones.
        """
        count = len(initial)
        shared = np.zeros((2 * count, len(self.parameters)))
        own = np.zeros((count, 2, 2))
        for sign, points, noise in ((-1, initial, initial_noise), (1, final, final_noise)):
            jacobians = self.projection.jacobians(points, self.parameters)
            inverse = np.linalg.inv(jacobians.point)
            shared -= sign * (inverse @ jacobians.parameters).reshape(shared.shape)
            own += inverse @ noise @ inverse.transpose(0, 2, 1)
        moved = self.bending * np.linalg.norm(final - initial, axis=1)
        own += moved[:, None, None] ** 2 * np.eye(2)
        covariance = shared @ self.covariance @ shared.T
        blocks = covariance.reshape(count, 2, count, 2)
        blocks[np.arange(count), :, np.arange(count)] += own
        return np.asarray(covariance)


@dataclass(frozen=True, eq=False)
class AlignedProjection:
    """A projection of a plane whose points a homography has taken to another frame."""

    projection: PlaneProjection
    homography: Homography

    def pixels(self, points: FloatArray, parameters: FloatArray) -> FloatArray:
        """See `PlaneProjection`."""
        return self.projection.pixels(self.homography.undone(points), parameters)

    def points(self, pixels: FloatArray, parameters: FloatArray) -> FloatArray:
        """See `PlaneProjection`."""
        return self.homography.moved(self.projection.points(pixels, parameters))

    def jacobians(self, points: FloatArray, parameters: FloatArray) -> Jacobians:
        """See `PlaneProjection`."""
        film = self.homography.undone(points)
        before = self.projection.jacobians(film, parameters)
        return before._replace(point=before.point @ np.linalg.inv(self.homography.jacobians(film)))


@dataclass(frozen=True)
class CameraProjection:
    """The plane z = `height` through a calibrated camera: rotation vector, translation and its intrinsics."""

    camera: Camera
    height: float = 0.0

    def pixels(self, points: FloatArray, parameters: FloatArray) -> FloatArray:
        """See `PlaneProjection`."""
        return self.camera.project(self._raised(points), _pose(parameters))

    def points(self, pixels: FloatArray, parameters: FloatArray) -> FloatArray:
        """See `PlaneProjection`: the ray of every pixel meets the plane."""
        pose = _pose(parameters)
        rotation = cv2.Rodrigues(pose.rotation)[0]
        plane = np.column_stack([rotation[:, :2], pose.translation + self.height * rotation[:, 2]])
        return _divided(self.camera.undistort(pixels), np.linalg.inv(self.camera.matrix @ plane))

    def jacobians(self, points: FloatArray, parameters: FloatArray) -> Jacobians:
        """See `PlaneProjection`."""
        pose = _pose(parameters)
        matrix, by_rotation = cv2.Rodrigues(pose.rotation)
        raised = self._raised(points)
        seen = self.camera.project_with_jacobians(raised @ matrix.T + pose.translation)
        turned = np.einsum("kij,nj->nik", by_rotation.reshape(3, 3, 3), raised)
        by_all = [seen.by_point @ turned, seen.by_point, seen.by_intrinsics]
        return Jacobians(seen.by_point @ matrix[:, :2], np.concatenate(by_all, axis=2))

    def _raised(self, points: FloatArray) -> FloatArray:
        return np.column_stack([points, np.full(len(points), self.height)])


@dataclass(frozen=True, eq=False)
class HomographyProjection:
    """A plane without a camera: the homography's entries but the last, which is 1, row by row.

    Attributes:
        entries: Linear map from the parameters to these entries, shape (8, k); the identity if k = 8.
    """

    entries: FloatArray

    def pixels(self, points: FloatArray, parameters: FloatArray) -> FloatArray:
        """See `PlaneProjection`."""
        return _divided(points, self._matrix(parameters))

    def points(self, pixels: FloatArray, parameters: FloatArray) -> FloatArray:
        """See `PlaneProjection`."""
        return _divided(pixels, np.linalg.inv(self._matrix(parameters)))

    def jacobians(self, points: FloatArray, parameters: FloatArray) -> Jacobians:
        """See `PlaneProjection`."""
        homography = self._matrix(parameters)
        pixels = _divided(points, homography)
        whole = np.column_stack([points, np.ones(len(points))])
        depth = (whole @ homography[2])[:, None, None]
        by_point = (homography[None, :2, :2] - pixels[:, :, None] * homography[2, :2]) / depth
        by_entries = np.zeros((len(points), 2, 8))
        by_entries[:, 0, :3] = by_entries[:, 1, 3:6] = whole
        by_entries[:, :, 6:] = -pixels[:, :, None] * points[:, None, :]
        return Jacobians(by_point, by_entries / depth @ self.entries)

    def _matrix(self, parameters: FloatArray) -> FloatArray:
        return np.append(self.entries @ parameters, 1.0).reshape(3, 3)


HOMOGRAPHY = HomographyProjection(np.eye(8))
SIMILARITY = HomographyProjection(np.eye(4)[[0, 1, 2, 1, 0, 3, 0, 0]] * np.c_[[1, 1, 1, 1, -1, 1, 0, 0]])
"""The linear transform of the paper: pixel = (a x + b y + c, b x - a y + d), because y is up in the plane."""


def _pose(parameters: FloatArray) -> Pose:
    return Pose(parameters[:3], parameters[3:6])


def _divided(points: FloatArray, homography: FloatArray) -> FloatArray:
    """Points, shape (n, 2), through a homography."""
    mapped = points @ homography[:, :2].T + homography[:, 2]
    return np.asarray(mapped[:, :2] / mapped[:, 2:])

"""Bundle adjustment: intrinsics and board poses fitted together to observed corners.

Least squares by the Levenberg-Marquardt method on the normal equations (B. Triggs et al., "Bundle
adjustment - a modern synthesis", Vision Algorithms, 1999, sections 4 and 9). `scipy.optimize.least_squares`
finds the same optimum to 1e-6 standard deviations, but takes 35 times as long at 40 views, since it
factorises the whole Jacobian; its sparse solver stops 1e-2 away after hundreds of times as many steps.
Units: mm, pixels.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from geometry.arrays import BoolArray, FloatArray, IntArray
from geometry.errors import UserError
from vision.calibration.camera import Camera

MAX_STEPS = 200
TOLERANCE = 1e-12
"""Relative change of the sum of squares at which the fit ends."""
MAX_DAMPING = 1e12


class Poses(NamedTuple):
    """Poses of the board in the camera's frame, one a view."""

    rotations: Rotation
    translations: FloatArray

    def to_camera(self, points: FloatArray, view: IntArray) -> FloatArray:
        """Points of the board, shape (n, 3), each in a view, shape (n,), in the camera's frame."""
        return np.asarray(self.rotations[view].apply(points) + self.translations[view])

    def moved(self, step: FloatArray) -> "Poses":
        """Turned and shifted in the camera's frame by a small step, shape (views, 6)."""
        return Poses(Rotation.from_rotvec(step[:, :3]) * self.rotations, self.translations + step[:, 3:])


@dataclass(frozen=True, eq=False)
class CornerObservations:
    """Corners seen in photographs, sorted by view.

    Attributes:
        points: In the board's frame, shape (n, 3), mm.
        pixels: In the image, shape (n, 2).
        view: Number of the view, shape (n,), from 0 and each at least once.
    """

    points: FloatArray
    pixels: FloatArray
    view: IntArray

    @property
    def starts(self) -> IntArray:
        """Index of the first corner of every view."""
        return np.flatnonzero(np.diff(self.view, prepend=-1))


class Adjustment(NamedTuple):
    """Result of a bundle adjustment.

    Attributes:
        camera: With the covariance of its free intrinsics.
        poses: Of the board.
        residuals: Observed minus predicted, shape (n, 2), pixels.
    """

    camera: Camera
    poses: Poses
    residuals: FloatArray


def adjust(camera: Camera, poses: Poses, observations: CornerObservations, *, free: BoolArray) -> Adjustment:
    """Fit intrinsics and poses, from a first guess of both.

    Args:
        camera: First guess.
        poses: First guess.
        observations: Corners to fit to.
        free: True for the intrinsics that are fitted, shape (intrinsics,).

    Raises:
        UserError: If a corner of the first guess is behind the camera.
        LinAlgError: If the corners do not determine the free intrinsics and the poses.
    """
    fitted = int(free.sum())
    residuals, normal, gradient = _linearised(camera, poses, observations, free)
    cost, damping = np.sum(residuals**2), 1e-3
    for _ in range(MAX_STEPS):
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), gradient)
        intrinsics = camera.intrinsics
        intrinsics[free] += step[:fitted]
        try:
            trial = camera.with_intrinsics(intrinsics), poses.moved(step[fitted:].reshape(-1, 6))
            linearised = _linearised(*trial, observations, free)
            trial_cost = np.sum(linearised[0] ** 2)
        except UserError:
            trial_cost = np.inf
        gain = cost - trial_cost
        if gain > 0:
            (camera, poses), cost, damping = trial, trial_cost, damping / 10
            residuals, normal, gradient = linearised
        else:
            damping *= 10
        if abs(gain) <= TOLERANCE * cost or damping > MAX_DAMPING:
            break
    scale = np.sqrt(np.outer(np.diag(normal), np.diag(normal)))  # columns scaled to one length
    inverse = (np.linalg.inv(normal / scale) / scale)[:fitted, :fitted]
    variance = cost / max(residuals.size - len(normal), 1)
    covariance = np.zeros((len(free), len(free)))
    covariance[np.ix_(free, free)] = 0.5 * variance * (inverse + inverse.T)
    return Adjustment(replace(camera, covariance=tuple(map(tuple, covariance.tolist()))), poses, residuals)


def _linearised(
    camera: Camera, poses: Poses, observations: CornerObservations, free: BoolArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Residuals, shape (n, 2), and matrix and right-hand side of the normal equations.

    The unknowns are the free intrinsics, then six numbers a view: a rotation vector and a shift.
    """
    turned = poses.rotations[observations.view].apply(observations.points)
    projection = camera.project_with_jacobians(turned + poses.translations[observations.view])
    residuals = observations.pixels - projection.pixels
    by_turn = np.cross(turned[:, None], projection.by_point)  # ω x point: the gradient is point x gradient
    jacobian = np.concatenate([projection.by_intrinsics[:, :, free], by_turn, projection.by_point], axis=2)
    blocks = np.add.reduceat(np.einsum("nki,nkj->nij", jacobian, jacobian), observations.starts)
    sides = np.add.reduceat(np.einsum("nki,nk->ni", jacobian, residuals), observations.starts)

    views, fitted = len(poses.translations), int(free.sum())
    pose = fitted + np.arange(6 * views).reshape(views, 6)
    places = np.column_stack([np.tile(np.arange(fitted), (views, 1)), pose])
    normal, gradient = np.zeros((places[-1, -1] + 1,) * 2), np.zeros(places[-1, -1] + 1)
    np.add.at(normal, (places[:, :, None], places[:, None, :]), blocks)
    np.add.at(gradient, places, sides)
    return residuals, normal, gradient

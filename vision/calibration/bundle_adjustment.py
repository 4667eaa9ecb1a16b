"""Bundle adjustment: a camera and the poses of a board, fitted together to where corners were seen.

Least squares by the Levenberg-Marquardt method. Poses are eliminated by the Schur complement, which leaves
the normal matrix of the intrinsics: its inverse is their covariance (B. Triggs et al., "Bundle adjustment - a
modern synthesis", Vision Algorithms, 1999, sections 6.1 and 9). Units: mm, pixels.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from geometry.arrays import BoolArray, FloatArray, IntArray
from geometry.errors import UserError
from vision.calibration.camera import Camera

STEPS = 200
TOLERANCE = 1e-12
"""Of the sum of squares, relative."""
MOST_DAMPING = 1e12


class Poses(NamedTuple):
    """Where the board is in the camera's frame in every view."""

    rotations: Rotation
    translations: FloatArray

    def place(self, points: FloatArray, view: IntArray) -> FloatArray:
        """Points of the board, shape (n, 3), each seen in a view, shape (n,), in the camera's frame."""
        return np.asarray(self.rotations[view].apply(points) + self.translations[view])

    def moved(self, step: FloatArray) -> "Poses":
        """Turned and shifted in the camera's frame by a small step, shape (views, 6)."""
        return Poses(Rotation.from_rotvec(step[:, :3]) * self.rotations, self.translations + step[:, 3:])


@dataclass(frozen=True, eq=False)
class CornerObservations:
    """Corners that were seen, sorted by view.

    Attributes:
        points: In the board's frame, shape (n, 3), mm.
        pixels: Where they were seen, shape (n, 2).
        view: In which view, shape (n,), from 0 and each at least once.
    """

    points: FloatArray
    pixels: FloatArray
    view: IntArray

    @property
    def starts(self) -> IntArray:
        """Where the views begin."""
        return np.flatnonzero(np.diff(self.view, prepend=-1))


class Adjustment(NamedTuple):
    """What was fitted.

    Attributes:
        camera: With the covariance of what was free.
        poses: Of the board.
        residuals: Seen minus predicted, shape (n, 2), pixels.
    """

    camera: Camera
    poses: Poses
    residuals: FloatArray


def adjust(camera: Camera, poses: Poses, observations: CornerObservations, *, free: BoolArray) -> Adjustment:
    """Fit intrinsics and poses, from a first guess of both.

    Args:
        camera: First guess.
        poses: First guess.
        observations: What was seen.
        free: Which of the camera's intrinsics are fitted, shape (intrinsics,).

    Raises:
        UserError: If a corner of the first guess is behind the camera.
        LinAlgError: If what was seen does not determine the free intrinsics and the poses.
    """
    residuals, normal = _linearised(camera, poses, observations, free)
    cost, damping = np.sum(residuals**2), 1e-3
    for _ in range(STEPS):
        intrinsics = camera.intrinsics
        step, move = normal.step(damping)
        intrinsics[free] += step
        try:
            trial, trial_poses = camera.with_intrinsics(intrinsics), poses.moved(move)
            missed = _missed(trial, trial_poses, observations)
        except UserError:
            trial_cost = np.inf
        else:
            trial_cost = np.sum(missed**2)
        gain = cost - trial_cost
        if gain > 0:
            camera, poses, cost, damping = trial, trial_poses, trial_cost, damping / 10
            residuals, normal = _linearised(camera, poses, observations, free)
        else:
            damping *= 10
        if abs(gain) <= TOLERANCE * cost or damping > MOST_DAMPING:
            break
    known = residuals.size - free.sum() - 6 * len(poses.translations)
    covariance = np.zeros((len(free), len(free)))
    covariance[np.ix_(free, free)] = normal.covariance() * cost / max(known, 1)
    return Adjustment(replace(camera, covariance=tuple(map(tuple, covariance.tolist()))), poses, residuals)


def _missed(camera: Camera, poses: Poses, observations: CornerObservations) -> FloatArray:
    return observations.pixels - camera.project(poses.place(observations.points, observations.view))


class _Normal(NamedTuple):
    """Normal equations in blocks: p intrinsics, six numbers a view.

    Attributes:
        camera, mixed, pose: Of the matrix, shapes (p, p), (views, p, 6) and (views, 6, 6).
        camera_side, pose_side: Right-hand side, shapes (p,) and (views, 6).
    """

    camera: FloatArray
    mixed: FloatArray
    pose: FloatArray
    camera_side: FloatArray
    pose_side: FloatArray

    def step(self, damping: float) -> tuple[FloatArray, FloatArray]:
        """The damped step of the intrinsics, shape (p,), and of the poses, shape (views, 6)."""
        pose = self.pose * (1 + damping * np.eye(6))
        reduced = self.camera * (1 + damping * np.eye(len(self.camera))) - self._eliminated(pose)
        by_pose = np.linalg.solve(pose, self.pose_side[:, :, None])
        step = np.linalg.solve(reduced, self.camera_side - np.sum(self.mixed @ by_pose, axis=0)[:, 0])
        rest = self.pose_side - np.einsum("p,vpi->vi", step, self.mixed)
        back = np.linalg.solve(pose, rest[:, :, None])
        return np.asarray(step), np.asarray(back[:, :, 0])

    def covariance(self) -> FloatArray:
        """Of the intrinsics for errors of 1 pixel, shape (p, p), from the columns scaled to one length."""
        scale = 1 / np.sqrt(np.diag(self.camera))
        reduced = (self.camera - self._eliminated(self.pose)) * np.outer(scale, scale)
        inverse = np.linalg.inv(reduced) * np.outer(scale, scale)
        return np.asarray(0.5 * (inverse + inverse.T))

    def _eliminated(self, pose: FloatArray) -> FloatArray:
        """What eliminating the poses takes from the matrix of the intrinsics, shape (p, p)."""
        return np.asarray(np.sum(self.mixed @ np.linalg.solve(pose, self.mixed.transpose(0, 2, 1)), axis=0))


def _linearised(
    camera: Camera, poses: Poses, observations: CornerObservations, free: BoolArray
) -> tuple[FloatArray, _Normal]:
    """Residuals, shape (n, 2), and the normal equations of the next step."""
    turned = poses.rotations[observations.view].apply(observations.points)
    seen = camera.project_with_jacobians(turned + poses.translations[observations.view])
    residuals = observations.pixels - seen.pixels
    by_camera = seen.by_intrinsics[:, :, free]
    by_turn = np.cross(turned[:, None], seen.by_point)  # ω x point: the gradient is point x gradient
    by_pose = np.concatenate([by_turn, seen.by_point], axis=2)
    starts = observations.starts

    def summed(left: FloatArray, right: FloatArray) -> FloatArray:
        return np.asarray(np.add.reduceat(np.einsum("nki,nkj->nij", left, right), starts))

    return residuals, _Normal(
        camera=summed(by_camera, by_camera).sum(axis=0),
        mixed=summed(by_camera, by_pose),
        pose=summed(by_pose, by_pose),
        camera_side=summed(by_camera, residuals[:, :, None]).sum(axis=0)[:, 0],
        pose_side=summed(by_pose, residuals[:, :, None])[:, :, 0],
    )

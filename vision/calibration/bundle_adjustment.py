"""Bundle adjustment: intrinsics and board poses fitted together to observed corners.

Least squares by the Levenberg-Marquardt method on the normal equations, from which the poses are eliminated
view by view (B. Triggs et al., "Bundle adjustment - a modern synthesis", Vision Algorithms, 1999, sections 4,
6 and 9). OpenCV's `calibrateCamera` reaches the same optimum to 1e-3 standard deviations, but starts from
poses of its own: of 60 sets of distant boards it ended in another minimum for two, and its
`fisheye.calibrate` gave up on 3 of 8 sets that determine the camera. Units: mm, pixels.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray
from pinnray.runtime.errors import UserError
from pinnray.vision.calibration.camera import Camera
from pinnray.vision.calibration.chessboard import Board

FEWEST_JACKKNIFED = 10
"""Number of views from which on their scatter counts for the covariance."""


class Poses(NamedTuple):
    """Poses of the board in the camera's coordinates, one a view."""

    rotations: Rotation
    translations: FloatArray

    def to_camera(self, points: FloatArray, view: IntArray) -> FloatArray:
        """Points of the board, shape (n, 3), each in a view, shape (n,), in the camera's coordinates."""
        return np.asarray(self.rotations[view].apply(points) + self.translations[view])

    def moved(self, step: FloatArray) -> "Poses":
        """Turned and shifted in the camera's coordinates by a small step, shape (views, 6)."""
        return Poses(Rotation.from_rotvec(step[:, :3]) * self.rotations, self.translations + step[:, 3:])


class Adjustment(NamedTuple):
    """Result of a bundle adjustment."""

    camera: Camera
    """With the covariance of its free intrinsics. Corners count as independent, unless the jackknife over
    views gives a larger standard deviation."""
    poses: Poses
    residuals: FloatArray
    """Observed minus predicted, shape (views, n, 2), pixels; NaN where a corner was not seen."""
    independent: FloatArray
    """Standard deviations of the intrinsics for independent corners, shape (intrinsics,)."""


def adjust(
    camera: Camera, poses: Poses, views: Sequence[FloatArray] | FloatArray, board: Board, *, free: BoolArray
) -> Adjustment:
    """Fit intrinsics and poses, from a first guess of both.

    Args:
        camera: First guess.
        poses: First guess.
        views: Corners of the board, shape (views, n, 2), pixels; NaN where one is not seen.
        board: In the views.
        free: True for the intrinsics that are fitted, shape (intrinsics,).

    Raises:
        UserError: If a corner of the first guess is behind the camera.
        LinAlgError: If the corners do not determine the free intrinsics and the poses.
    """
    views, fitted = np.asarray(views), int(free.sum())
    equations = _linearised(camera, poses, views, board, free)
    cost, damping = np.nansum(equations.residuals**2), 1e-3
    for _ in range(200):
        blocks, sides, by_intrinsics = equations.without_poses(damping)
        step = np.linalg.solve(blocks.sum(axis=0), sides.sum(axis=0))
        intrinsics = camera.intrinsics
        intrinsics[free] += step
        try:
            trial = (
                camera.with_intrinsics(intrinsics),
                poses.moved(by_intrinsics @ np.append(-step, 1.0)),
            )
            linearised = _linearised(*trial, views, board, free)
            gain = cost - np.nansum(linearised.residuals**2)
        except UserError:
            gain = -np.inf
        if gain > 0:
            (camera, poses), equations = trial, linearised
            cost, damping = cost - gain, damping / 10
        else:
            damping *= 10
        if abs(gain) <= 1e-12 * cost or damping > 1e12:
            break
    blocks, sides, _ = equations.without_poses()
    inverse = np.linalg.inv(_scaled(blocks.sum(axis=0))) / _lengths(blocks.sum(axis=0))
    unknowns = fitted + 6 * len(views)
    independent = (inverse + inverse.T) / 2 * cost / max(np.isfinite(views).sum() - unknowns, 1)
    larger = np.sqrt(np.maximum(_jackknife(blocks, sides) / np.diag(independent), 1.0))
    covariance = np.zeros((len(free), len(free)))
    covariance[np.ix_(free, free)] = independent * np.outer(larger, larger)
    deviations = np.zeros(len(free))
    deviations[free] = np.sqrt(np.diag(independent))
    known = replace(camera, covariance=tuple(map(tuple, covariance.tolist())))
    return Adjustment(known, poses, equations.residuals, deviations)


class _Equations(NamedTuple):
    """Normal equations of every view for the free intrinsics, a rotation vector and a shift."""

    residuals: FloatArray
    blocks: FloatArray
    """Matrices, shape (views, fitted + 6, fitted + 6)."""
    sides: FloatArray
    """Right-hand sides, shape (views, fitted + 6)."""

    def without_poses(self, damping: float = 0.0) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Matrices and right-hand sides of the intrinsics alone, and the poses as functions of these.

        The poses' steps are the last product, shape (views, 6, fitted + 1), with (-step, 1).
        """
        fitted = self.sides.shape[1] - 6
        damped = self.blocks * (1 + damping * np.eye(fitted + 6))
        shared, pose = damped[:, :fitted, fitted:], damped[:, fitted:, fitted:]
        whole = np.concatenate([damped[:, :, :fitted], self.sides[:, :, None]], axis=2)
        by_intrinsics = np.linalg.solve(pose, whole[:, fitted:])
        reduced = whole[:, :fitted] - shared @ by_intrinsics
        return reduced[:, :, :fitted], reduced[:, :, fitted], by_intrinsics


def _linearised(camera: Camera, poses: Poses, views: FloatArray, board: Board, free: BoolArray) -> _Equations:
    view, corner = np.nonzero(np.isfinite(views[:, :, 0]))
    turned = poses.rotations[view].apply(board.corners[corner])
    projection = camera.project_with_jacobians(turned + poses.translations[view])
    residuals = np.full(views.shape, np.nan)
    missed = residuals[view, corner] = views[view, corner] - projection.pixels
    by_turn = np.cross(turned[:, None], projection.by_point)  # ω x point: the gradient is point x gradient
    jacobian = np.concatenate([projection.by_intrinsics[:, :, free], by_turn, projection.by_point], axis=2)
    starts = np.flatnonzero(np.diff(view, prepend=-1))
    blocks = np.add.reduceat(np.einsum("nki,nkj->nij", jacobian, jacobian), starts)
    return _Equations(residuals, blocks, np.add.reduceat(np.einsum("nki,nk->ni", jacobian, missed), starts))


def _jackknife(blocks: FloatArray, sides: FloatArray) -> FloatArray:
    """Variances of the intrinsics by the jackknife over views, to first order, shape (fitted,).

    The errors of the corners in one photograph are correlated: by its blur, its light, the bend of the board.
    Leaving out a view changes the intrinsics by their common effect. Zero with fewer than `FEWEST_JACKKNIFED`
    views, whose scatter is uncertain.

    Source: C. F. J. Wu, "Jackknife, bootstrap and other resampling methods in regression analysis",
    Annals of Statistics 14, 1986.
    """
    views, fitted = sides.shape
    if views < FEWEST_JACKKNIFED:
        return np.zeros(fitted)
    kept = blocks.sum(axis=0) - blocks
    lengths = np.sqrt(np.diagonal(kept, axis1=1, axis2=2))
    steps = np.linalg.solve(_scaled(kept), (sides / lengths)[:, :, None])[:, :, 0] / lengths
    return np.asarray((views - 1) / views * (steps**2).sum(axis=0))


def _lengths(matrices: FloatArray) -> FloatArray:
    """Products of the square roots of the diagonal entries, shape (..., n, n)."""
    diagonal = np.diagonal(matrices, axis1=-2, axis2=-1)
    if not (diagonal > 0).all():
        raise np.linalg.LinAlgError("an unknown is not determined")
    lengths = np.sqrt(diagonal)
    return np.asarray(lengths[..., :, None] * lengths[..., None, :])


def _scaled(matrices: FloatArray) -> FloatArray:
    """Matrices with ones on the diagonal, for an accurate solution, shape (..., n, n)."""
    return np.asarray(matrices / _lengths(matrices))

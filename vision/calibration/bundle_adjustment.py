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
FEWEST_JACKKNIFED = 10
"""Number of views from which on their scatter counts for the covariance."""


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
        camera: With the covariance of its free intrinsics: that of independent corners, with the standard
            deviations of the jackknife over views where these are larger.
        poses: Of the board.
        residuals: Observed minus predicted, shape (n, 2), pixels.
        independent: Standard deviations of the intrinsics if the errors of the corners are independent, shape
            (intrinsics,), which tell whether the views determine the camera.
    """

    camera: Camera
    poses: Poses
    residuals: FloatArray
    independent: FloatArray


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
    equations = _linearised(camera, poses, observations, free)
    normal, gradient = equations.assembled()
    cost, damping = np.sum(equations.residuals**2), 1e-3
    for _ in range(MAX_STEPS):
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), gradient)
        intrinsics = camera.intrinsics
        intrinsics[free] += step[:fitted]
        try:
            trial = camera.with_intrinsics(intrinsics), poses.moved(step[fitted:].reshape(-1, 6))
            linearised = _linearised(*trial, observations, free)
            trial_cost = np.sum(linearised.residuals**2)
        except UserError:
            trial_cost = np.inf
        gain = cost - trial_cost
        if gain > 0:
            (camera, poses), cost, damping = trial, trial_cost, damping / 10
            equations = linearised
            normal, gradient = equations.assembled()
        else:
            damping *= 10
        if abs(gain) <= TOLERANCE * cost or damping > MAX_DAMPING:
            break
    scale = np.sqrt(np.outer(np.diag(normal), np.diag(normal)))  # columns scaled to one length
    inverse = (np.linalg.inv(normal / scale) / scale)[:fitted, :fitted]
    variance = cost / max(equations.residuals.size - len(normal), 1)
    independent = 0.5 * variance * (inverse + inverse.T)
    larger = np.sqrt(np.maximum(equations.jackknife() / np.diag(independent), 1.0))
    covariance = np.zeros((len(free), len(free)))
    covariance[np.ix_(free, free)] = independent * np.outer(larger, larger)
    known = replace(camera, covariance=tuple(map(tuple, covariance.tolist())))
    deviations = np.zeros(len(free))
    deviations[free] = np.sqrt(np.diag(independent))
    return Adjustment(known, poses, equations.residuals, deviations)


class _Equations(NamedTuple):
    """Normal equations of every view.

    Attributes:
        residuals: Shape (n, 2), pixels.
        blocks: Matrices, shape (views, fitted + 6, fitted + 6); the unknowns are the free intrinsics, then a
            rotation vector and a shift of the view.
        sides: Right-hand sides, shape (views, fitted + 6).
    """

    residuals: FloatArray
    blocks: FloatArray
    sides: FloatArray

    def assembled(self) -> tuple[FloatArray, FloatArray]:
        """Matrix and right-hand side of all: the free intrinsics, then six unknowns a view."""
        views, fitted = len(self.sides), self.sides.shape[1] - 6
        pose = fitted + np.arange(6 * views).reshape(views, 6)
        places = np.column_stack([np.tile(np.arange(fitted), (views, 1)), pose])
        normal, gradient = np.zeros((places[-1, -1] + 1,) * 2), np.zeros(places[-1, -1] + 1)
        np.add.at(normal, (places[:, :, None], places[:, None, :]), self.blocks)
        np.add.at(gradient, places, self.sides)
        return normal, gradient

    def jackknife(self) -> FloatArray:
        """Variances of the free intrinsics by the jackknife over views, to first order, shape (fitted,).

        The errors of the corners in one photograph are correlated: by its blur, its light, the bend of the
        board. Leaving out a view changes the intrinsics by what its corners say together. Zero with fewer
        than `FEWEST_JACKKNIFED` views, whose scatter says little.

        Source: C. F. J. Wu, "Jackknife, bootstrap and other resampling methods in regression analysis",
        Annals of Statistics 14, 1986.
        """
        views, fitted = len(self.sides), self.sides.shape[1] - 6
        if views < FEWEST_JACKKNIFED:
            return np.zeros(fitted)
        own, shared, pose = (
            self.blocks[:, part, other]
            for part, other in (
                (np.s_[:fitted], np.s_[:fitted]),
                (np.s_[:fitted], np.s_[fitted:]),
                (np.s_[fitted:], np.s_[fitted:]),
            )
        )
        by_pose = np.linalg.solve(pose, shared.transpose(0, 2, 1)).transpose(0, 2, 1)
        reduced = own - by_pose @ shared.transpose(0, 2, 1)
        sides = self.sides[:, :fitted] - (by_pose @ self.sides[:, fitted:, None])[:, :, 0]
        without = reduced.sum(axis=0) - reduced
        lengths = np.sqrt(np.diagonal(without, axis1=1, axis2=2))  # columns scaled to one length
        scaled = without / (lengths[:, :, None] * lengths[:, None, :])
        steps = np.linalg.solve(scaled, (sides / lengths)[:, :, None])[:, :, 0] / lengths
        return np.asarray((views - 1) / views * (steps**2).sum(axis=0))


def _linearised(
    camera: Camera, poses: Poses, observations: CornerObservations, free: BoolArray
) -> _Equations:
    """Normal equations of the residuals, observed minus predicted."""
    turned = poses.rotations[observations.view].apply(observations.points)
    projection = camera.project_with_jacobians(turned + poses.translations[observations.view])
    residuals = observations.pixels - projection.pixels
    by_turn = np.cross(turned[:, None], projection.by_point)  # ω x point: the gradient is point x gradient
    jacobian = np.concatenate([projection.by_intrinsics[:, :, free], by_turn, projection.by_point], axis=2)
    blocks = np.add.reduceat(np.einsum("nki,nkj->nij", jacobian, jacobian), observations.starts)
    sides = np.add.reduceat(np.einsum("nki,nk->ni", jacobian, residuals), observations.starts)
    return _Equations(residuals, blocks, sides)

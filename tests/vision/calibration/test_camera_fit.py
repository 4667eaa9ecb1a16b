"""The covariance of a fitted camera against dense least squares, OpenCV, and the scatter of fits."""

import cv2
import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from pinnray.vision.calibration.camera import Camera, Pose
from pinnray.vision.calibration.camera_fit import fit_camera
from tests.vision.calibration.chessboards import BOARD, CAMERA, poses, views

SIZE = (CAMERA.width, CAMERA.height)
ALL = np.array(list(views(6, noise=0.3).values()))
SOME = np.where(np.random.default_rng(5).random((6, 54, 1)) < 0.4, ALL, np.nan)


def seen_by(camera: Camera, six: np.ndarray, corners: np.ndarray = BOARD.corners) -> np.ndarray:
    """Corners in every view, shape (views, 54, 2), by poses, shape (views, 6)."""
    boards = np.broadcast_to(corners, (len(six), 54, 3))
    return np.array(
        [camera.project(each, Pose(*np.split(pose, 2))) for each, pose in zip(boards, six, strict=True)]
    )


@pytest.mark.parametrize("seen", [ALL, SOME])
def test_fit_and_covariance_are_those_of_the_dense_problem(seen):
    found = fit_camera(list(seen), BOARD, SIZE, k3=False)

    def missed(unknowns):
        camera = CAMERA.with_intrinsics([*unknowns[:8], 0])
        return (seen_by(camera, unknowns[8:].reshape(6, 6)) - seen)[np.isfinite(seen)]

    begin = [*CAMERA.intrinsics[:8], *np.concatenate([np.concatenate(pose) for pose in poses(6)])]
    dense = least_squares(missed, begin, x_scale="jac", xtol=1e-12, ftol=1e-12, jac="3-point")
    upper = np.linalg.qr(dense.jac, mode="r")
    covariance = np.linalg.inv(upper.T @ upper) * 2 * dense.cost / (dense.jac.shape[0] - 44)  # type: ignore[attr-defined]
    deviations = np.sqrt(np.diag(covariance))[:8]
    assert (np.abs(found.camera.intrinsics[:8] - dense.x[:8]) < 0.01 * deviations).all()
    scale = np.outer(deviations, deviations)
    known = np.array(found.camera.covariance)
    np.testing.assert_allclose(known[:8, :8] / scale, covariance[:8, :8] / scale, rtol=0, atol=1e-3)
    assert not known[8].any()  # what is fixed has no error
    assert np.nansum(found.residuals**2) == pytest.approx(2 * dense.cost)


def test_standard_deviations_are_those_of_opencv():
    points, pixels = [BOARD.corners.astype(np.float32)] * 6, [view.astype(np.float32) for view in ALL]
    *_, deviations, _, _ = cv2.calibrateCameraExtended(points, pixels, SIZE, np.eye(3), np.zeros(5))
    known = fit_camera(list(ALL), BOARD, SIZE, k3=True).camera.standard_deviations
    np.testing.assert_allclose(known, deviations.ravel()[:9], rtol=2e-3)


def scores(*, bend: float, fits: int = 20, count: int = 15) -> np.ndarray:
    """Errors of the intrinsics over their standard deviations, root mean square, of boards bent by mm."""
    x, y, _ = (BOARD.corners - BOARD.corners.mean(axis=0)).T / 80
    rng, found = np.random.default_rng(1), []
    six = np.array([np.concatenate(pose) for pose in poses(count)])
    for _ in range(fits):
        curved = np.tile(BOARD.corners, (count, 1, 1))
        bowl, saddle = bend * rng.standard_normal((2, count, 1))
        curved[:, :, 2] = bowl * (x**2 + y**2) + saddle * x * y
        seen = seen_by(CAMERA, six, curved)
        seen = seen + rng.normal(0, 0.1, seen.shape)
        camera = fit_camera(list(seen), BOARD, SIZE, k3=False).camera
        found.append((camera.intrinsics - CAMERA.intrinsics)[:8] / camera.standard_deviations[:8])
    return np.sqrt(np.mean(np.square(found), axis=0))


@pytest.mark.slow
def test_errors_that_the_corners_of_a_photograph_share_are_in_the_standard_deviations():
    """Without the jackknife the scores of bent boards are 4 to 6."""
    assert scores(bend=1.0).max() < 1.6  # 20 fits tell a deviation within a sixth
    assert scores(bend=0.0).min() > 0.6  # the larger of two deviations is a little too large


def test_a_distant_board_whose_tilt_could_be_the_other_way_gives_the_right_camera():
    """A distant plane looks almost the same when it is tilted the other way."""
    rng, count = np.random.default_rng(2), 12
    way = rng.uniform(0, 2 * np.pi, count)
    axes = np.column_stack([np.cos(way), np.sin(way), np.zeros(count)])
    turns = Rotation.from_rotvec(np.radians(rng.uniform(15, 35, count))[:, None] * axes)
    centres = rng.uniform((-120, -60, 800), (120, 60, 1000), (count, 3))
    shifts = centres - turns.apply(BOARD.corners.mean(axis=0))
    exact = seen_by(CAMERA, np.column_stack([turns.as_rotvec(), shifts]))
    found = fit_camera(list(exact + rng.normal(0, 0.3, exact.shape)), BOARD, SIZE, k3=False).camera
    off = (found.intrinsics - CAMERA.intrinsics)[:8]
    assert (np.abs(off) < 3.5 * np.array(found.standard_deviations[:8])).all()

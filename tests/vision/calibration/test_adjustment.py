"""The adjustment against the dense least-squares problem, solved by SciPy, and against OpenCV."""

import cv2
import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from pinnray.vision.calibration.bundle_adjustment import Poses, adjust
from tests.vision.calibration.chessboards import BOARD, CAMERA, poses, views

ALL = np.array(list(views(6, noise=0.3).values()))
SOME = np.where(np.random.default_rng(5).random((6, 54, 1)) < 0.4, ALL, np.nan)
FREE = np.arange(9) < 8
START = CAMERA.with_intrinsics([1000, 1000, 640, 360, 0, 0, 0, 0, 0])


def placed(count: int = 6) -> Poses:
    rotations, translations = zip(*poses(count), strict=True)
    return Poses(Rotation.from_rotvec(rotations), np.array(translations))


def projected(camera, board: Poses, corners: np.ndarray = BOARD.corners) -> np.ndarray:
    """All corners in every view, shape (views, 54, 2); `corners` may differ from view to view."""
    view = np.repeat(np.arange(len(board.rotations)), 54)
    points = np.array(np.broadcast_to(corners, (len(board.rotations), 54, 3))).reshape(-1, 3)
    return camera.project(board.to_camera(points, view)).reshape(-1, 54, 2)


@pytest.mark.parametrize("seen", [ALL, SOME])
def test_fit_and_covariance_are_those_of_the_dense_problem(seen):
    found = adjust(START, placed(), seen, BOARD, free=FREE)

    def missed(unknowns):
        six = unknowns[8:].reshape(6, 6)
        board = Poses(Rotation.from_rotvec(six[:, :3]), six[:, 3:])
        residuals = projected(CAMERA.with_intrinsics([*unknowns[:8], 0]), board) - seen
        return residuals[np.isfinite(seen)]

    begin = [*CAMERA.intrinsics[:8], *np.column_stack([placed().rotations.as_rotvec(), placed()[1]]).ravel()]
    dense = least_squares(missed, begin, x_scale="jac", xtol=1e-12, ftol=1e-12, jac="3-point")
    upper = np.linalg.qr(dense.jac, mode="r")
    covariance = np.linalg.inv(upper.T @ upper) * 2 * dense.cost / (dense.jac.shape[0] - 44)  # type: ignore[attr-defined]
    deviations = np.sqrt(np.diag(covariance))[:8]
    assert (np.abs(found.camera.intrinsics[:8] - dense.x[:8]) < 1e-3 * deviations).all()
    scale = np.outer(deviations, deviations)
    known = np.array(found.camera.covariance)
    np.testing.assert_allclose(known[:8, :8] / scale, covariance[:8, :8] / scale, rtol=0, atol=1e-4)
    assert not known[8].any()  # what is fixed has no error


def test_camera_and_standard_deviations_are_those_of_opencv():
    found = adjust(START, placed(), ALL, BOARD, free=FREE).camera
    points, pixels = [BOARD.corners.astype(np.float32)] * 6, [view.astype(np.float32) for view in ALL]
    size, flags = (CAMERA.width, CAMERA.height), cv2.CALIB_FIX_K3
    _, matrix, distortion, *_, deviations, _, _ = cv2.calibrateCameraExtended(
        points, pixels, size, np.eye(3), np.zeros(5), flags=flags
    )
    known = np.array(found.standard_deviations)
    np.testing.assert_allclose(known, deviations.ravel()[:9], rtol=2e-3)
    expected = [*matrix[[0, 1, 0, 1], [0, 1, 2, 2]], *distortion.ravel()[:4]]
    assert (np.abs(found.intrinsics[:8] - expected) < 0.02 * known[:8]).all()


def scores(*, bend: float, fits: int = 20, count: int = 15) -> np.ndarray:
    """Errors of the intrinsics over their standard deviations, root mean square, of boards bent by mm."""
    x, y, _ = (BOARD.corners - BOARD.corners.mean(axis=0)).T / 80
    rng, found = np.random.default_rng(1), []
    for _ in range(fits):
        curved = np.tile(BOARD.corners, (count, 1, 1))
        bowl, saddle = bend * rng.standard_normal((2, count, 1))
        curved[:, :, 2] = bowl * (x**2 + y**2) + saddle * x * y
        exact = projected(CAMERA, placed(count), curved)
        seen = exact + rng.normal(0, 0.1, exact.shape)
        camera = adjust(CAMERA, placed(count), seen, BOARD, free=FREE).camera
        found.append((camera.intrinsics - CAMERA.intrinsics)[:8] / camera.standard_deviations[:8])
    return np.sqrt(np.mean(np.square(found), axis=0))


@pytest.mark.slow
def test_errors_that_the_corners_of_a_photograph_share_are_in_the_standard_deviations():
    """Without the jackknife the scores of bent boards are 4 to 6."""
    assert scores(bend=1.0).max() < 1.6  # 20 fits tell a deviation within a sixth
    assert scores(bend=0.0).min() > 0.6  # the larger of two deviations is a little too large


def test_a_known_camera_leaves_only_the_poses():
    found = adjust(CAMERA, placed(), SOME, BOARD, free=np.zeros(9, dtype=bool))
    assert found.camera.intrinsics.tolist() == CAMERA.intrinsics.tolist()
    assert np.nanmean(np.abs(found.residuals)) < 0.3
    off = found.poses.moved(np.full((6, 6), 1e-4))  # it is a minimum
    assert np.nansum((projected(CAMERA, off) - SOME) ** 2) > np.nansum(found.residuals**2)

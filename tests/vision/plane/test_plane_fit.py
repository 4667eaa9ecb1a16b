"""Fits of the plane to fiducials: least squares, covariances by refits, and what the fits cannot do."""

from dataclasses import replace
from itertools import product
from typing import Any

import cv2
import numpy as np
import pytest
from scipy.optimize import least_squares

from pinnray.geometry.finger.design import Design
from pinnray.runtime.arrays import FloatArray
from pinnray.vision.calibration.camera import Camera
from pinnray.vision.rig.virtual_camera import default_camera, viewing_pose
from pinnray.vision.tracking.marker_plane import SIMILARITY, MarkerPlane
from pinnray.vision.tracking.plane_fit import (
    camera_plane,
    homography_plane,
    plane_of_markers,
    similarity_plane,
)
from pinnray.vision.tracking.workspace import default_workspace
from tests.vision.fingers import MARKERS as FRONT
from tests.vision.fingers import PRESSED

CAMERA = Camera(1280, 720, 1200.0, 1190.0, 652.0, 349.0, distortion=(-0.12, 0.05, 1e-3, -5e-4, 0.01))
POSE = np.array([2.8, 0.2, -0.3, -40.0, -10.0, 150.0])
POINTS = np.array([[-10.0, 15], [20, 14], [60, 17], [100, 15], [-12, -40], [45, -42], [100, -38]])
MARKERS = np.array([[10.0, -2], [25, -4], [40, -3], [55, -6], [70, -5], [85, -8]])
RANDOM = np.random.default_rng(4)
ROOTS = RANDOM.normal(0, 0.05, (7, 2, 2)) + 0.05 * np.eye(2)
NOISE = ROOTS @ ROOTS.transpose(0, 2, 1)
MISSED = RANDOM.normal(0, 1.0, (7, 2))


def seen(points: FloatArray, camera: Camera = CAMERA, height: float = 0.0) -> FloatArray:
    flat = np.column_stack([points, np.full(len(points), height)])
    return cv2.projectPoints(flat, POSE[:3], POSE[3:], camera.matrix, np.array(camera.distortion))[0][:, 0]


def squares_of(plane: MarkerPlane, pixels: FloatArray, parameters: FloatArray) -> FloatArray:
    """Residuals in standard deviations, shape (14,)."""
    missed = plane.projection.pixels(POINTS, parameters) - pixels
    roots = np.linalg.cholesky(NOISE)
    return np.asarray(np.linalg.solve(roots, missed[:, :, None]).ravel())


def fitted(kind: str, pixels: FloatArray, noise: FloatArray = NOISE, **changes: Any) -> MarkerPlane:
    if kind == "camera":
        return camera_plane(changes.pop("camera", CAMERA), POINTS, pixels, noise, **changes)
    return {"homography": homography_plane, "similarity": similarity_plane}[kind](POINTS, pixels, noise)


@pytest.mark.parametrize(("kind", "count"), [("camera", 6), ("homography", 8), ("similarity", 4)])
def test_a_fit_is_that_of_weighted_least_squares(kind: str, count: int) -> None:
    """By SciPy from the fit itself, with slopes of differences; to a thousandth of a standard deviation."""
    pixels = seen(POINTS) + MISSED
    plane = fitted(kind, pixels)

    def residuals(values: FloatArray) -> FloatArray:
        return squares_of(plane, pixels, np.append(values, plane.parameters[count:]))

    best = least_squares(residuals, plane.parameters[:count], jac="3-point", x_scale="jac", xtol=1e-14)
    slopes = best.jac
    step = best.x - plane.parameters[:count]
    assert np.linalg.norm(slopes @ step) < 1e-3
    away = plane.points(pixels) - POINTS
    assert plane.residual == pytest.approx(np.sqrt((away**2).sum() / 7), rel=1e-12)


def slopes_by_refits(kind: str, count: int, pixels: FloatArray) -> FloatArray:
    """Derivatives of the fitted parameters by the pixels, shape (count, 14), by central differences."""
    columns = []
    for number in range(pixels.size):
        step = np.zeros(pixels.size)
        step[number] = 1e-3
        ends = [fitted(kind, pixels + sign * step.reshape(-1, 2)).parameters[:count] for sign in (1, -1)]
        columns.append((ends[0] - ends[1]) / 2e-3)
    return np.column_stack(columns)


def in_deviations(covariance: FloatArray, expected: FloatArray) -> None:
    """Compare covariances in units of the expected deviations."""
    scale = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(
        covariance / np.outer(scale, scale), expected / np.outer(scale, scale), atol=2e-3
    )


@pytest.mark.parametrize(("kind", "count"), [("camera", 6), ("homography", 8), ("similarity", 4)])
def test_the_covariance_is_that_of_refits_to_noisy_pixels(kind: str, count: int) -> None:
    """Of pixels that the projection explains, so that nothing is left to inflate it."""
    plane = fitted(kind, seen(POINTS))
    exact = plane.projection.pixels(POINTS, plane.parameters)
    slopes = slopes_by_refits(kind, count, exact)
    whole = np.zeros((14, 14))
    for number, own in enumerate(NOISE):
        whole[2 * number : 2 * number + 2, 2 * number : 2 * number + 2] = own
    found = fitted(kind, exact).covariance
    in_deviations(found[:count, :count], slopes @ whole @ slopes.T)
    assert not found[count:].any()


def test_errors_of_the_camera_are_in_the_covariance_of_pose_and_intrinsics() -> None:
    """Refits with cameras whose intrinsics are changed, one by one."""
    deviations = np.array([3.0, 2.0, 1.0, 1.5, 0.01, 0.02, 1e-3, 1e-3, 0.01])
    root = np.diag(deviations) @ (np.eye(9) + 0.3 * np.tri(9, k=-1))
    known = replace(CAMERA, covariance=tuple(map(tuple, (root @ root.T).tolist())))
    pixels = seen(POINTS)
    tiny = 1e-8 * NOISE
    covariance = fitted("camera", pixels, tiny, camera=known).covariance
    columns = []
    for number, deviation in enumerate(deviations):
        step = 1e-3 * deviation * np.eye(9)[number]
        ends = [
            fitted("camera", pixels, tiny, camera=CAMERA.with_intrinsics(CAMERA.intrinsics + sign * step))
            for sign in (1, -1)
        ]
        columns.append((ends[0].parameters - ends[1].parameters) / (2e-3 * deviation))
    slopes = np.column_stack(columns)
    in_deviations(covariance, slopes @ root @ root.T @ slopes.T)


def test_a_rotation_is_by_half_a_turn_at_most() -> None:
    """Whichever way round the fit ends; a pose and its covariance are compared by their numbers."""
    for step in np.linspace(0, 0.01, 9):
        turn = fitted("camera", seen(POINTS) + MISSED + step).parameters[:3]
        assert np.linalg.norm(turn) <= np.pi


def misfit_of(plane: MarkerPlane, pixels: FloatArray) -> float:
    return float((squares_of(plane, pixels, plane.parameters) ** 2).sum())


def test_a_misfit_beyond_the_noise_widens_the_pose_by_its_degrees_of_freedom() -> None:
    """14 coordinates less the six of the pose."""
    pixels = seen(POINTS) + MISSED
    found, quiet = fitted("camera", pixels), fitted("camera", pixels, 1e4 * NOISE)
    factor = misfit_of(found, pixels) / 8
    assert factor > 5
    in_deviations(found.covariance[:6, :6], 1e-4 * factor * quiet.covariance[:6, :6])


@pytest.mark.parametrize(("kind", "count"), [("homography", 8), ("similarity", 4)])
def test_what_is_left_without_a_lens_counts_once_for_every_fiducial(kind: str, count: int) -> None:
    """A mean over the seven does not reduce it: seven times the excess over the noise."""
    exact = fitted(kind, seen(POINTS))
    pixels = exact.pixels(POINTS) + 0.2 * MISSED
    found, quiet = fitted(kind, pixels), fitted(kind, pixels, 1e8 * NOISE)
    excess = misfit_of(found, pixels) / (14 - count) - 1
    assert 1 < excess < 50
    in_deviations(found.covariance, 1e-8 * (1 + 7 * excess) * quiet.covariance)


@pytest.mark.parametrize(("fit", "count"), [(homography_plane, 4), (similarity_plane, 2)])
def test_as_many_fiducials_as_parameters_have_no_misfit(fit: Any, count: int) -> None:
    points = POINTS[[0, 3, 4, 6]][:count]
    plane = fit(points, seen(points), NOISE[:count])
    np.testing.assert_allclose(plane.pixels(points), seen(points), atol=1e-4)
    assert np.isfinite(plane.covariance).all()


def test_a_similarity_starts_from_any_turn_and_scale() -> None:
    for a, b in ((-8.0, 0.5), (0.1, 12.0), (3.0, -4.0)):
        exact = SIMILARITY.pixels(POINTS, np.array([a, b, -50.0, 700.0]))
        np.testing.assert_allclose(
            similarity_plane(POINTS, exact, NOISE).parameters, [a, b, -50, 700], rtol=1e-6
        )


def test_a_plane_of_markers_bends_by_what_the_similarity_leaves() -> None:
    """√5 times the misfit of a coordinate, less the noise, over the root mean square distance."""
    scale = 8.0
    bow = 0.02 * np.column_stack([np.zeros(6), (MARKERS[:, 0] - 47.5) ** 2 / 100])
    pixels = SIMILARITY.pixels(MARKERS + bow, np.array([scale, 0.0, 100.0, 300.0]))
    noise = np.tile(np.diag([0.01, 0.02]), (6, 1, 1))
    for factor in (1e-6, 0.05):
        plane = plane_of_markers(MARKERS, pixels, factor * noise)
        own = plane.scales(MARKERS)
        assert own == pytest.approx(np.full(6, scale), rel=0.01)
        misfit = (plane.residual**2 - factor * 0.03 / own[0] ** 2) / 2
        spread = MARKERS.var(axis=0).sum()
        assert plane.bending == pytest.approx(np.sqrt(5 * misfit / spread), rel=1e-6)
        assert plane.bending > 0
    assert plane_of_markers(MARKERS, pixels, 1e3 * noise).bending == 0


def test_a_plane_from_markers_alone_states_what_lens_and_tilt_do_to_their_displacements() -> None:
    """The shares within 1.96 standard deviations; 0.8 by the errors of scale and turn alone."""
    before, after = FRONT["front"], FRONT["front"] + np.array(PRESSED["front"])[0]
    ratios = []
    for lens, tilt, direction in product((-0.2, -0.1, 0.1, 0.2), (0, 2, 5), (0, 120, 240)):
        camera = replace(default_camera(), distortion=(lens, -0.2 * lens, 5e-4, -3e-4, 0.0))
        pose = viewing_pose(camera, default_workspace(Design()), tilt=tilt, direction=direction)
        ends = [camera.project(np.column_stack([each, np.zeros(9)]), pose) for each in (before, after)]
        covariances = np.tile(1e-4 * np.eye(2), (9, 1, 1))
        plane = plane_of_markers(before, ends[0], covariances)
        places = plane.points(ends[0]), plane.points(ends[1])
        stated = plane.displacement_covariance(*places, covariances, covariances)
        missed = (places[1] - places[0]) - (after - before)
        ratios.append(missed.ravel() / np.sqrt(np.diag(stated)))
    assert 0.9 < (np.abs(ratios) < 1.96).mean() < 0.99

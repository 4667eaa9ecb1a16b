"""Planes against the cameras that saw them, and their covariances against repeated measurements."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from geometry.finger.design import Design
from tests.vision.calibration.chessboards import projected
from tests.vision.fingers import MARKERS, PRESSED
from tests.vision.tracking.test_fiducials import pose_of
from vision.calibration.camera import Camera
from vision.discs.disc_detector import DiscDetections
from vision.rig.shapes import centroid, circle, closed
from vision.rig.virtual_camera import default_camera, viewing_pose
from vision.tracking.plane_fit import camera_plane, homography_plane, plane_of_markers, similarity_plane
from vision.tracking.scene import FilmedScene
from vision.tracking.workspace import default_workspace

CAMERA = Camera(1280, 720, 1200.0, 1195.0, 652.0, 349.0, distortion=(-0.12, 0.05, 1e-3, -5e-4, 0.0))
FIDUCIALS = default_workspace(Design()).points
BEFORE = MARKERS["front"]
AFTER = BEFORE + np.array(PRESSED["front"])[0]
POSE = pose_of(10, (4, -3), 145)
NOISE = 0.05
"""Pixels."""


def seen(points, camera=CAMERA, *, height=0.0):
    return projected(camera, np.column_stack([points, np.full(len(points), height)]), POSE)


def noise(count):
    return np.repeat(NOISE**2 * np.eye(2)[None], count, axis=0)


PINHOLE = replace(CAMERA, distortion=(0.0,) * 5)
FLAT = pose_of(10, (0, 0), 145)


@pytest.mark.parametrize("height", [0.0, 7.5])
def test_a_calibrated_camera_sees_points_where_they_are(height):
    plane = camera_plane(CAMERA, FIDUCIALS, seen(FIDUCIALS), noise(7), height=height)
    np.testing.assert_allclose(plane.points(seen(AFTER, height=height)), AFTER, rtol=0, atol=1e-6)
    np.testing.assert_allclose(plane.pixels(AFTER), seen(AFTER, height=height), rtol=0, atol=1e-5)
    assert plane.residual < 1e-6


def test_forgetting_the_height_of_the_markers_costs_what_the_scale_says():
    plane = camera_plane(CAMERA, FIDUCIALS, seen(FIDUCIALS), noise(7))
    moved = np.diff(plane.points(seen(np.array([[0.0, 0.0], [80.0, 0.0]]), height=7.5)), axis=0)
    assert np.linalg.norm(moved) == pytest.approx(80 * (1 + 7.5 / 145), rel=0.01)


def test_a_homography_is_exact_without_a_lens():
    plane = homography_plane(FIDUCIALS, seen(FIDUCIALS, PINHOLE), noise(7))
    np.testing.assert_allclose(plane.points(seen(AFTER, PINHOLE)), AFTER, rtol=0, atol=1e-8)
    assert plane.residual < 1e-8


def test_a_homography_tells_by_its_residual_that_there_is_a_lens():
    assert homography_plane(FIDUCIALS, seen(FIDUCIALS), noise(7)).residual > 0.05


@pytest.mark.parametrize("fit", [homography_plane, similarity_plane])
def test_what_a_fit_without_a_lens_leaves_does_not_shrink_with_the_noise(fit):
    pixels = projected(CAMERA, np.column_stack([FIDUCIALS, np.zeros(7)]), FLAT)
    before, after = (projected(CAMERA, np.column_stack([at, np.zeros(9)]), FLAT) for at in (BEFORE, AFTER))
    deviations = []
    for scale in (0.1, 0.01):  # of noise, far below what the lens does
        plane = fit(FIDUCIALS, pixels, scale**2 * noise(7))
        initial, final = plane.points(before), plane.points(after)
        covariance = plane.displacement_covariance(initial, final, 0 * noise(9), 0 * noise(9))
        deviations.append(np.sqrt(np.trace(covariance) / 18))
    assert deviations[1] == pytest.approx(deviations[0], rel=0.1)
    missed = np.sqrt(np.mean((final - initial - (AFTER - BEFORE)) ** 2))
    assert 0.3 < missed / deviations[1] < 3


def test_a_similarity_is_exact_for_a_camera_that_looks_straight_down():
    pixels = projected(PINHOLE, np.column_stack([BEFORE, np.zeros(9)]), FLAT)
    square = replace(PINHOLE, fy=PINHOLE.fx)
    pixels, after = (
        projected(square, np.column_stack([points, np.zeros(9)]), FLAT) for points in (BEFORE, AFTER)
    )
    plane = similarity_plane(BEFORE, pixels, noise(9))
    np.testing.assert_allclose(plane.points(after), AFTER, rtol=0, atol=1e-8)


def views():
    """A plane of every kind, and the camera that it is exact for."""
    yield "camera", CAMERA, lambda pixels: camera_plane(CAMERA, FIDUCIALS, pixels, noise(7), height=3.0)
    yield "homography", PINHOLE, lambda pixels: homography_plane(FIDUCIALS, pixels, noise(7))
    yield "similarity", PINHOLE, lambda pixels: similarity_plane(FIDUCIALS, pixels, noise(7))


@pytest.mark.parametrize(("name", "camera", "fit"), views())
def test_slopes_are_those_of_differences(name, camera, fit):
    plane = fit(seen(FIDUCIALS, camera))
    slopes = plane.projection.jacobians(AFTER, plane.parameters)
    for axis in range(2):
        step = 1e-4 * np.eye(2)[axis]
        difference = (plane.pixels(AFTER + step) - plane.pixels(AFTER - step)) / 2e-4
        np.testing.assert_allclose(slopes.point[:, :, axis], difference, rtol=0, atol=1e-5)
    for number in range(6 if name == "camera" else len(plane.parameters)):  # the intrinsics: see test_camera
        step = 1e-6 * np.eye(len(plane.parameters))[number] * max(1, abs(plane.parameters[number]))
        up, down = (plane.projection.pixels(AFTER, plane.parameters + sign * step) for sign in (1, -1))
        difference = (up - down) / (2 * step[number])
        np.testing.assert_allclose(slopes.parameters[:, :, number], difference, rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize(("name", "camera", "fit"), views())
def test_the_covariance_of_displacements_is_that_of_repeated_measurements(name, camera, fit):
    """200 repetitions know a standard deviation to 5 percent, and the mean of 18 much better."""
    generator = np.random.default_rng(0)
    height = 3.0 if name == "camera" else 0.0
    exact = [
        seen(points, camera, height=level)
        for points, level in ((FIDUCIALS, 0), (BEFORE, height), (AFTER, height))
    ]
    plane = fit(exact[0])
    if name == "similarity":  # of a tilted plane: what is exact is the image of the map itself
        exact = [plane.pixels(points) for points in (FIDUCIALS, BEFORE, AFTER)]
        plane = fit(exact[0])
    found = []
    for _ in range(200):
        fiducials, before, after = (pixels + generator.normal(0, NOISE, pixels.shape) for pixels in exact)
        again = fit(fiducials)
        found.append((again.points(after) - again.points(before)).ravel())
    covariance = plane.displacement_covariance(BEFORE, AFTER, noise(9), noise(9))
    ratio = np.std(found, axis=0) / np.sqrt(np.diag(covariance))
    assert np.sqrt(np.mean(ratio**2)) == pytest.approx(1, abs=0.06)
    assert ratio.min() > 0.8
    assert ratio.max() < 1.25
    correlation = np.corrcoef(np.transpose(found))
    deviation = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(correlation, covariance / np.outer(deviation, deviation), rtol=0, atol=0.3)


def test_errors_of_the_fiducials_mostly_cancel_in_displacements():
    plane = camera_plane(CAMERA, FIDUCIALS, seen(FIDUCIALS), noise(7))
    none = np.zeros((9, 2, 2))
    shift = plane.displacement_covariance(BEFORE, BEFORE, none, none)
    np.testing.assert_allclose(shift, 0, rtol=0, atol=1e-12)
    small = np.sqrt(np.diag(plane.displacement_covariance(BEFORE, AFTER, none, none)).max())
    assert 0 < small < 0.3 * NOISE * 145 / 1200


def pictured(points, radius, camera):
    """The middles of the pictures of circles in the plane z = 0, by polygons of 512 corners."""
    return np.array([centroid(closed(seen(circle(point, radius), camera))) for point in points])


def test_the_middle_of_an_ellipse_is_that_of_its_conic():
    plane = homography_plane(FIDUCIALS, seen(FIDUCIALS, PINHOLE), noise(7))
    inverse = np.linalg.inv(np.append(plane.parameters, 1.0).reshape(3, 3))
    (x, y), radius = BEFORE[3], 2.0
    conic = inverse.T @ np.array([[1, 0, -x], [0, 1, -y], [-x, -y, x * x + y * y - radius**2]]) @ inverse
    middle = np.linalg.solve(conic[:2, :2], -conic[:2, 2])
    beside = middle - plane.pixels(BEFORE[3:4])[0]
    assert np.linalg.norm(beside) > 0.015
    np.testing.assert_allclose(plane.beside(BEFORE[3:4], radius)[0], beside, rtol=0, atol=5e-4)


def test_a_lens_moves_the_middles_of_discs_which_is_undone():
    plane = camera_plane(CAMERA, FIDUCIALS, seen(FIDUCIALS), noise(7))
    middles = pictured(FIDUCIALS, 2.0, CAMERA)
    assert np.abs(plane.points(middles) - FIDUCIALS).max() > 4e-3
    np.testing.assert_allclose(plane.circles(middles, 2.0), FIDUCIALS, rtol=0, atol=1e-4)


def test_the_plane_of_fiducials_is_that_of_their_discs():
    scene = FilmedScene(Design(), default_workspace(Design()), CAMERA)
    discs = DiscDetections(pictured(FIDUCIALS, 2.0, CAMERA), noise(7), np.full(7, 16.0), np.full(7, 180.0))
    plane = scene.plane(discs)
    assert plane.residual < 1e-4
    np.testing.assert_allclose(
        plane.points(seen(AFTER)) - plane.points(seen(BEFORE)), AFTER - BEFORE, atol=1e-4
    )


def test_a_plane_from_markers_alone_states_what_lens_and_tilt_do_to_their_displacements():
    """The shares within 1.96 standard deviations; 0.8 by the errors of scale and turn alone."""
    ratios = []
    for lens, tilt, direction in product((-0.2, -0.1, 0.1, 0.2), (0, 2, 5), (0, 120, 240)):
        camera = replace(default_camera(), distortion=(lens, -0.2 * lens, 5e-4, -3e-4, 0.0))
        pose = viewing_pose(camera, default_workspace(Design()), tilt=tilt, direction=direction)
        before, after = (
            projected(camera, np.column_stack([points, np.zeros(len(points))]), pose)
            for points in (BEFORE, AFTER)
        )
        covariances = noise(len(BEFORE)) / 25
        plane = plane_of_markers(BEFORE, before, covariances)
        places = plane.points(before), plane.points(after)
        stated = plane.displacement_covariance(*places, covariances, covariances)
        missed = (places[1] - places[0]) - (AFTER - BEFORE)
        ratios.append(missed.ravel() / np.sqrt(np.diag(stated)))
    assert 0.9 < (np.abs(ratios) < 1.96).mean() < 0.99

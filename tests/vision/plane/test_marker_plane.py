"""Projections of the plane by hand and by OpenCV, their slopes by differences, and errors propagated so."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest

from pinnray.geometry.picture_frame import Homography
from pinnray.runtime.arrays import FloatArray
from pinnray.vision.calibration.camera import Camera
from pinnray.vision.tracking.marker_plane import (
    HOMOGRAPHY,
    SIMILARITY,
    AlignedProjection,
    CameraProjection,
    MarkerPlane,
    PlaneProjection,
)

CAMERA = Camera(1280, 720, 1200.0, 1190.0, 652.0, 349.0, distortion=(-0.12, 0.05, 1e-3, -5e-4, 0.01))
POSE = np.array([np.pi - 0.1, 0.15, -0.2, -40.0, -10.0, 150.0])
POINTS = np.array([[0.0, 0.0], [30.0, -5.0], [75.0, 12.0], [90.0, -20.0]])
KINDS: dict[str, tuple[PlaneProjection, FloatArray]] = {
    "camera": (CameraProjection(CAMERA, 4.0), np.append(POSE, CAMERA.intrinsics)),
    "homography": (HOMOGRAPHY, np.array([8.0, 1.0, 100.0, 0.5, -7.0, 700.0, 1e-3, -5e-4])),
    "similarity": (SIMILARITY, np.array([6.0, -2.0, 300.0, 400.0])),
    "aligned": (
        AlignedProjection(
            HOMOGRAPHY, Homography(np.array([40.0, -8.0]), np.array([3.0, 0.5, -0.3, 0.02, 0.01, -0.02]))
        ),
        np.array([8.0, 1.0, 100.0, 0.5, -7.0, 700.0, 1e-3, -5e-4]),
    ),
}


def plane(name: str, **changes: float) -> MarkerPlane:
    projection, parameters = KINDS[name]
    random = np.random.default_rng(len(parameters))
    root = np.diag(1e-4 * np.maximum(np.abs(parameters), 1e-2)) @ random.normal(size=(len(parameters),) * 2)
    return MarkerPlane(projection, parameters, root @ root.T, 0.0, **changes)


def slopes_of(function: Callable[[FloatArray], FloatArray], place: FloatArray) -> FloatArray:
    """Derivatives by central differences, shape (values, entries)."""
    columns = []
    for number in range(len(place)):
        step = np.zeros(len(place))
        step[number] = 1e-5 * max(1e-2, abs(place[number]))
        rise = function(place + step) - function(place - step)
        columns.append(rise.ravel() / (2 * step[number]))
    return np.column_stack(columns)


@pytest.mark.parametrize("height", [0.0, 4.0, -6.0])
def test_a_camera_sees_the_plane_at_its_height_as_opencv_does(height: float) -> None:
    raised = np.column_stack([POINTS, np.full(4, height)])
    seen = cv2.projectPoints(raised, POSE[:3], POSE[3:], CAMERA.matrix, np.array(CAMERA.distortion))[0][:, 0]
    projection = CameraProjection(CAMERA, height)
    np.testing.assert_allclose(projection.pixels(POINTS, POSE), seen, rtol=1e-10)
    np.testing.assert_allclose(projection.points(seen, POSE), POINTS, atol=1e-8)
    assert CameraProjection(CAMERA).height == 0


@pytest.mark.parametrize("name", KINDS)
def test_points_are_the_inverse_of_pixels(name: str) -> None:
    found = plane(name)
    np.testing.assert_allclose(found.points(found.pixels(POINTS)), POINTS, atol=1e-8)


@pytest.mark.parametrize("name", KINDS)
def test_slopes_are_those_of_differences(name: str) -> None:
    projection, parameters = KINDS[name]
    found = projection.jacobians(POINTS, parameters)
    assert found.point.shape == (4, 2, 2)
    assert found.parameters.shape == (4, 2, len(parameters))
    for number, point in enumerate(POINTS):
        by_point = slopes_of(lambda place: projection.pixels(place[None], parameters), point)
        np.testing.assert_allclose(found.point[number], by_point, rtol=1e-6, atol=1e-7)
    held = 6 if name == "camera" else len(parameters)  # a camera projects with its own intrinsics
    by_all = slopes_of(lambda values: projection.pixels(POINTS, values), parameters[:held])
    np.testing.assert_allclose(found.parameters[..., :held].reshape(8, -1), by_all, rtol=1e-6, atol=1e-5)
    if name == "camera":

        def with_intrinsics(values: FloatArray) -> FloatArray:
            return CameraProjection(CAMERA.with_intrinsics(values), 4.0).pixels(POINTS, POSE)

        by_camera = slopes_of(with_intrinsics, CAMERA.intrinsics)
        np.testing.assert_allclose(found.parameters[..., 6:].reshape(8, -1), by_camera, rtol=1e-5, atol=1e-4)


def test_the_scale_is_the_root_of_the_areas_ratio() -> None:
    np.testing.assert_allclose(plane("similarity").scales(POINTS), np.sqrt(6**2 + 2**2), rtol=1e-12)
    step = 1e-3
    corners = np.array([[0, 0], [step, 0], [step, step], [0, step]])
    found = plane("camera").scales(POINTS)
    for point, scale in zip(POINTS, found, strict=True):
        x, y = plane("camera").pixels(point - step / 2 + corners).T
        area = 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))
        assert scale == pytest.approx(np.sqrt(area) / step, rel=1e-6)


@pytest.mark.parametrize("radius", [2.0, 5.0])
def test_the_image_of_a_circle_is_beside_that_of_its_centre(radius: float) -> None:
    """The middle of the ellipse, by the conic of the circle; a similarity has circles around the centres."""
    found = plane("homography")
    inverse = np.linalg.inv(np.append(found.parameters, 1.0).reshape(3, 3))
    for (x, y), beside in zip(POINTS, found.beside(POINTS, radius), strict=True):
        circle = np.array([[1, 0, -x], [0, 1, -y], [-x, -y, x * x + y * y - radius**2]])
        conic = inverse.T @ circle @ inverse
        middle = np.linalg.solve(conic[:2, :2], -conic[:2, 2])
        np.testing.assert_allclose(beside, middle - found.pixels(np.array([[x, y]]))[0], rtol=1e-3)
    np.testing.assert_allclose(plane("similarity").beside(POINTS, radius), 0, atol=1e-9)


@pytest.mark.parametrize("name", KINDS)
def test_centres_of_circles_come_back_from_their_images(name: str) -> None:
    """Two frames of two markers, one of which was not detected."""
    found = plane(name)
    images = (found.pixels(POINTS) + found.beside(POINTS, 0.8)).reshape(2, 2, 2)
    images[1, 0, 1] = np.nan
    centres = found.circles(images, 0.8)
    assert centres.shape == (2, 2, 2)
    assert np.isnan(centres[1, 0]).all()
    known = centres.reshape(-1, 2)[[0, 1, 3]]
    np.testing.assert_allclose(known, POINTS[[0, 1, 3]], atol=1e-5)


@pytest.mark.parametrize("name", KINDS)
def test_the_covariance_of_displacements_is_propagated_from_parameters_and_pixels(name: str) -> None:
    """To first order, by differences of the whole map from parameters and both ends' pixels."""
    found, final = plane(name), POINTS + np.array([[1.0, -2], [0, -5], [-3, -4], [2, 0]])
    random, count = np.random.default_rng(2), len(found.parameters)
    roots = random.normal(0, 0.05, (2, 4, 2, 2))
    noise = roots @ roots.transpose(0, 1, 3, 2)
    ends = np.stack([found.pixels(POINTS), found.pixels(final)])

    def moved(values: FloatArray) -> FloatArray:
        projection, parameters = found.projection, values[:count]
        if name == "camera":
            projection = CameraProjection(CAMERA.with_intrinsics(parameters[6:]), 4.0)
        before, after = values[count:].reshape(2, 4, 2)
        return projection.points(after, parameters) - projection.points(before, parameters)

    slopes = slopes_of(moved, np.concatenate([found.parameters, ends.ravel()]))
    whole = np.zeros((count + 16, count + 16))
    whole[:count, :count] = found.covariance
    for number, own in enumerate(noise.reshape(8, 2, 2)):
        rows = slice(count + 2 * number, count + 2 * number + 2)
        whole[rows, rows] = own
    covariance = found.displacement_covariance(POINTS, final, *noise)
    np.testing.assert_allclose(covariance, slopes @ whole @ slopes.T, rtol=1e-3, atol=1e-8)

"""The lenses against OpenCV, and their derivatives against differences."""

import cv2
import numpy as np
import pytest

from vision.calibration.lens import BrownLens, FisheyeLens

BROWN = BrownLens(-0.25, 0.08, 1e-3, -5e-4, -0.03)
FISHEYE = FisheyeLens(0.05, -0.02, 0.004, -0.001)
SOURCES = [(BROWN, cv2.projectPoints), (FISHEYE, cv2.fisheye.projectPoints)]
PLANE = np.random.default_rng(1).uniform(-1.2, 1.2, (40, 2))


@pytest.mark.parametrize(("lens", "source"), SOURCES)
def test_points_go_where_opencv_puts_them(lens, source):
    points = np.column_stack([PLANE, np.ones(40)])[:, None]
    coefficients = np.array(list(vars(lens).values()))
    expected = source(points, np.zeros(3), np.zeros(3), np.eye(3), coefficients)[0]
    np.testing.assert_allclose(lens.distort(PLANE), expected.reshape(-1, 2), rtol=0, atol=1e-12)


@pytest.mark.parametrize("lens", [BROWN, FISHEYE])
def test_slopes_are_those_of_differences(lens):
    step = 1e-6
    for axis in range(2):
        shift = step * np.eye(2)[axis]
        difference = (lens.distort(PLANE + shift) - lens.distort(PLANE - shift)) / (2 * step)
        np.testing.assert_allclose(lens.jacobian(PLANE)[:, :, axis], difference, rtol=0, atol=1e-8)


@pytest.mark.parametrize("lens", [BROWN, FISHEYE])
def test_a_lens_is_linear_in_its_coefficients(lens):
    bent = lens.by_coefficients(PLANE) @ np.array(list(vars(lens).values()))
    np.testing.assert_allclose(type(lens)().distort(PLANE) + bent, lens.distort(PLANE), rtol=0, atol=1e-12)


def test_a_fisheye_maps_angles_to_distances():
    angles = np.radians([10, 45, 80])
    bent = FisheyeLens().distort(np.column_stack([np.tan(angles), np.zeros(3)]))
    np.testing.assert_allclose(bent[:, 0], angles, rtol=1e-12)


@pytest.mark.parametrize("lens", [BROWN, FISHEYE])
def test_a_lens_does_nothing_on_its_axis(lens):
    axis = np.zeros((1, 2))
    np.testing.assert_array_equal(lens.distort(axis), axis)
    np.testing.assert_allclose(lens.jacobian(axis)[0], np.eye(2), atol=1e-12)

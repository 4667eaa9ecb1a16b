"""Matérn's kernels against Bessel functions, and their fields against differences."""

import numpy as np
import pytest

from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.solvers.statistics.kernel_field import SMOOTHNESS, KernelField, correlation
from tests.solvers.statistics.kernels import matern


def at(points):
    """Places that have no mesh."""
    return LocatedPoints(points, np.full(len(points), -1), np.full((len(points), 3), np.nan))


@pytest.fixture
def points():
    return np.random.default_rng(1).uniform(0, 90, (2, 12, 2))


@pytest.mark.parametrize("kernel", SMOOTHNESS)
def test_kernels_are_those_of_the_textbook(points, kernel):
    found = correlation(*points, 17.0, kernel)  # type: ignore[call-arg]
    np.testing.assert_allclose(found, matern(*points, 17.0, SMOOTHNESS[kernel]), atol=1e-12)  # type: ignore[call-arg]
    np.testing.assert_allclose(np.diag(correlation(points[0], points[0], 17.0, kernel)), 1.0)


@pytest.mark.parametrize("kernel", SMOOTHNESS)
def test_the_gradient_is_the_derivative_also_at_the_centres(points, kernel):
    centres, others = points
    field = KernelField(centres, np.linspace(-2, 3, 24).reshape(12, 2), np.array([9.0, 30.0]), kernel)
    places, step = np.concatenate([others, centres]), 1e-5
    for axis in (0, 1):
        shift = step * np.eye(2)[axis]
        ends = [field.displacement(at(places + sign * shift)) for sign in (1, -1)]
        expected = (ends[0] - ends[1]) / (2 * step)
        np.testing.assert_allclose(field.gradient(at(places))[:, :, axis], expected, atol=1e-6)

"""Matérn's kernel against Bessel functions, and its fields against differences."""

import numpy as np
import pytest

from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.solvers.statistics.kernel_field import KernelField, correlation
from tests.solvers.statistics.kernels import matern


def at(points):
    """Places that have no mesh."""
    return LocatedPoints(points, np.full(len(points), -1), np.full((len(points), 3), np.nan))


@pytest.fixture
def points():
    return np.random.default_rng(1).uniform(0, 90, (2, 12, 2))


def test_the_kernel_is_that_of_the_textbook(points):
    first, second = points
    np.testing.assert_allclose(correlation(first, second, 17.0), matern(first, second, 17.0), atol=1e-12)
    np.testing.assert_allclose(np.diag(correlation(first, first, 17.0)), 1.0)


def test_the_gradient_is_the_derivative_also_at_the_centres(points):
    centres, others = points
    field = KernelField(centres, np.linspace(-2, 3, 24).reshape(12, 2), np.array([9.0, 30.0]))
    places, step = np.concatenate([others, centres]), 1e-5
    for axis in (0, 1):
        shift = step * np.eye(2)[axis]
        ends = [field.displacement(at(places + sign * shift)) for sign in (1, -1)]
        expected = (ends[0] - ends[1]) / (2 * step)
        np.testing.assert_allclose(field.gradient(at(places))[:, :, axis], expected, atol=1e-6)

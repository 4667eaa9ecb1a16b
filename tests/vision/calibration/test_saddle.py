"""The fit of a corner to its own picture, and to pictures of none."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from pinnray.vision.calibration.corner_refinement import refine_corners

SIZE, FINE = 40, 20
EDGES = np.array([[[1.0, 0.1], [-0.3, 1.0]]])


def corner(centre: tuple[float, float], *, blur: float) -> np.ndarray:
    """Two edges that cross, averaged over the pixels and blurred, without the formula of the fit."""
    place = (np.arange(SIZE * FINE) + 0.5) / FINE - 0.5
    x, y = np.meshgrid(place - centre[0], place - centre[1])
    sides = [edge[0] * y - edge[1] * x > 0 for edge in EDGES[0]]
    pixels = np.where(sides[0] == sides[1], 200.0, 40.0).reshape(SIZE, FINE, SIZE, FINE).mean(axis=(1, 3))
    return np.rint(gaussian_filter(pixels, blur)).astype(np.uint8)


@pytest.mark.parametrize(("blur", "border"), [(0.5, 0), (1.0, 0), (2.0, 0), (1.0, 16)])
def test_a_corner_is_found_where_it_is(blur, border):
    image = corner((19.7, 20.3), blur=blur)[border:]
    found = refine_corners(image, np.array([[20.3, 19.9 - border]]), EDGES, np.array([8.0]))
    np.testing.assert_allclose(found[0], (19.7, 20.3 - border), rtol=0, atol=0.01)


@pytest.mark.parametrize(
    "image",
    [
        np.full((SIZE, SIZE), 128, dtype=np.uint8),  # nothing
        np.tile(np.where(np.arange(SIZE) < 20, 40, 200).astype(np.uint8), (SIZE, 1)),  # one edge
        corner((25.0, 20.0), blur=1.0),  # too far away
    ],
)
def test_what_is_no_corner_is_not_found(image):
    found = refine_corners(image, np.array([[20.0, 20.0]]), EDGES, np.array([8.0]))
    assert np.isnan(found).all()

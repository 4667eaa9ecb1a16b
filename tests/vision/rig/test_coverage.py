"""The covered share of pixels against closed forms and against another program's polygons."""

import numpy as np
import pytest
from shapely import Polygon, box

from pinnray.vision.rig.render import pixel_coverage
from pinnray.vision.rig.shapes import circle, closed, rectangle

SIZE = (14, 11)
STAR = 3.7 + 3.3 * np.array([(0, -1), (0.2, 0.1), (1.4, 0), (0.1, 0.4), (0.3, 1.2), (-0.7, 0.3)])


def on_grid(edges, size=SIZE):
    share = np.zeros(size[::-1])
    rows, columns, part = pixel_coverage(edges, size)
    share[rows, columns] = part
    return share


@pytest.mark.parametrize(
    "shift",
    [
        (0, 0),
        (0.37, -0.81),
        (-5.5, 1.2),  # cut by the left border
        (8.2, 6.9),  # cut at the lower right corner
        (-30, 2),  # outside
        (0.3, -2.0),  # a corner on a line of the grid
    ],
)
def test_a_polygon_with_a_hole_covers_what_shapely_says(shift):
    outer, hole = STAR + shift, np.array([(3.2, 4.2), (3.6, 4.8), (3.9, 4.2)]) + shift
    edges = np.concatenate([closed(outer), closed(hole)])
    body = Polygon(outer, [hole])
    assert body.is_valid
    columns, rows = SIZE
    expected = [
        [body.intersection(box(x, y, x + 1, y + 1)).area for x in range(columns)] for y in range(rows)
    ]
    np.testing.assert_allclose(on_grid(edges), expected, rtol=0, atol=1e-12)


def test_edges_may_come_in_any_order_and_the_body_on_either_side():
    edges = np.concatenate([closed(STAR), rectangle((8, 2), (12.5, 3.25))])
    shuffled = np.random.default_rng(0).permutation(edges)
    np.testing.assert_allclose(on_grid(shuffled), on_grid(edges), atol=1e-12)
    np.testing.assert_allclose(on_grid(edges[:, ::-1]), on_grid(edges), atol=1e-12)


@pytest.mark.parametrize("radius", [0.4, 7.6, 19])
def test_a_circle_keeps_its_area(radius):
    centre = np.array([25.31, 24.68])
    share = on_grid(closed(circle(centre, radius)), (50, 50))
    assert share.sum() == pytest.approx(np.pi * radius**2, rel=1e-12)

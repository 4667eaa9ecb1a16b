import numpy as np
import pytest

from pinnray.comparison.figures.canvas import Canvas, Extent
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh

RED, BLUE = (200, 10, 20), (10, 20, 200)


@pytest.fixture(scope="module")
def canvas(mesh: TriangleMesh) -> Canvas:
    """Ten pixels a mm around the body of 12 by 4 mm, with 1 mm of nothing on every side."""
    return Canvas(mesh, Extent(-1, 13, -5, 1), width=140)


def halves(mesh: TriangleMesh) -> np.ndarray:
    """Red left of x = 6, blue right of it."""
    left = mesh.points[mesh.triangles].mean(axis=1)[:, 0] < 6
    return np.where(left[:, None], RED, BLUE).astype(np.uint8)


def at(image: np.ndarray, x: float, y: float) -> tuple[int, ...]:
    """The pixel that shows the point (x, y), mm."""
    return tuple(int(value) for value in image[round((1 - y) * 10 - 0.5), round((x + 1) * 10 - 0.5)])


def test_colours_are_where_the_triangles_are(canvas: Canvas, mesh: TriangleMesh) -> None:
    image = canvas.picture(halves(mesh), mesh.points)
    assert image.shape == (60, 140, 4)
    assert at(image, 0.55, -0.55) == (*RED, 255)
    assert at(image, 5.75, -3.45) == (*RED, 255)
    assert at(image, 6.25, -0.55) == (*BLUE, 255)


def test_the_body_ends_where_it_ends(canvas: Canvas, mesh: TriangleMesh) -> None:
    opaque = canvas.picture(halves(mesh), mesh.points)[:, :, 3] == 255
    rows, columns = np.flatnonzero(opaque.any(axis=1)), np.flatnonzero(opaque.any(axis=0))
    assert (rows[0], rows[-1]) == pytest.approx((10, 49), abs=1)
    assert (columns[0], columns[-1]) == pytest.approx((10, 129), abs=1)


def test_the_body_is_drawn_where_its_nodes_have_gone(canvas: Canvas, mesh: TriangleMesh) -> None:
    image = canvas.picture(halves(mesh), mesh.points + np.array([0, 0.8]))
    assert at(image, 3, 0.5)[3] == 255
    assert at(image, 3, -3.8)[3] == 0


def test_the_body_at_rest_is_where_the_mesh_has_it_after_it_was_elsewhere(canvas, mesh):
    canvas.picture(halves(mesh), mesh.points + np.array([0, 0.8]))
    np.testing.assert_array_equal(canvas.picture(halves(mesh)), canvas.picture(halves(mesh), mesh.points))


def test_pixels_on_an_edge_are_means_of_the_triangles_in_their_quarters(mesh: TriangleMesh) -> None:
    """Five pixels a mm, of a body moved by half a pixel: halves and quarters of red, blue and nothing."""
    coarse = Canvas(mesh, Extent(-1, 13, -5, 1), width=70)
    image = coarse.picture(halves(mesh), mesh.points + 0.1).astype(int)
    covered = image[image[:, :, 3] > 0]
    quarters = np.arange(5)[:, None] / 4
    mixtures = quarters * RED + (1 - quarters) * BLUE
    assert set(np.unique(covered[:, 3])) == {63, 127, 255}
    distance = np.abs(covered[:, None, :3] - mixtures).max(axis=2).min(axis=1)
    assert (distance <= 1).mean() == 1  # a byte is rounded down
    assert (np.abs(covered[:, None, :3] - (RED, BLUE)).max(axis=2).min(axis=1) > 1).any()

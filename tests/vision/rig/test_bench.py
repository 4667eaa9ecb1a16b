"""The finger on the bench: what is drawn is what the truth says."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.geometry.finger.design import Design
from pinnray.vision.rig.bench import FINGER, Bench
from pinnray.vision.rig.print_layers import DIRECTION, PERIOD, PrintLayers
from pinnray.vision.rig.render import mean_light, pixel_coverage
from pinnray.vision.rig.shapes import Scene, area
from pinnray.vision.rig.virtual_camera import default_camera, viewing_pose
from pinnray.vision.tracking.workspace import default_workspace

WORKSPACE = default_workspace(Design())
CAMERA = default_camera()


@pytest.fixture(scope="module")
def bench(coarse_mesh):
    return Bench(coarse_mesh, Design(), WORKSPACE.model_copy(update={"marker_plane": 4.0}))


def bent(mesh):
    """A displacement that turns the finger more the nearer the tip is, mm."""
    x = mesh.points[:, 0] / 90
    return 12 * np.column_stack([-0.2 * x**2, -(x**2)])


def test_every_marker_is_drawn_where_the_truth_says_it_is(bench):
    displacement = bent(bench.mesh)
    pose = viewing_pose(CAMERA, WORKSPACE)
    scene = bench.scene(displacement)
    drawn = Scene((1.0, 1.0, 1.0), scene.shapes[-9:])
    dark = 1 - mean_light([drawn], CAMERA, pose, 0.8)[:, :, 0].astype(np.float64)
    y, x = np.mgrid[:720, :1280]
    truth = CAMERA.project(bench.markers(displacement), pose)
    for centre in truth:
        column, row = np.rint(centre).astype(int)
        window = np.s_[row - 15 : row + 16, column - 15 : column + 16]
        mass = dark[window].sum()
        found = np.array([(x * dark)[window].sum(), (y * dark)[window].sum()]) / mass
        # Of the picture of a disc that bends, the middle is near that of the disc only.
        np.testing.assert_allclose(found, centre, rtol=0, atol=0.02)


def test_every_other_layer_covers_half_of_the_finger(bench):
    shapes = replace(bench, layers=0.2).scene(bent(bench.mesh)).shapes
    body, dark = (shape for shape in shapes if shape.colour in (FINGER, tuple(0.8 * np.array(FINGER))))
    assert area(dark.edges) == pytest.approx(area(body.edges) / 2, rel=0.01)  # 250 layers end anywhere


def test_layers_at_rest_are_stripes(bench):
    """A pixel of the finger is dark where its place across the layers is in an even one."""
    edges = PrintLayers.on(bench.mesh.points, bench.mesh.triangles).edges(bench.mesh.points)
    cells = 0.02  # mm
    low = bench.mesh.points.min(axis=0)
    size = tuple(np.ceil(np.ptp(bench.mesh.points, axis=0) / cells).astype(int))
    rows, columns, dark = pixel_coverage((edges - low) / cells, size)
    body = pixel_coverage((bench.mesh.points[bench.mesh.boundary_edges] - low) / cells, size).share
    x, y = np.meshgrid(np.arange(columns.start, columns.stop) + 0.5, np.arange(rows.start, rows.stop) + 0.5)
    layer = (np.stack([x, y], axis=-1) * cells + low) @ DIRECTION / (PERIOD / 2)
    clear = np.abs(layer - np.rint(layer)) > 0.1
    inside = body[rows, columns] > 1 - 1e-9
    expected = np.floor(layer) % 2 == 0
    np.testing.assert_allclose(dark[clear & inside], expected[clear & inside], atol=1e-6)


def test_the_truth_is_the_displaced_nodes_in_the_markers_plane(bench):
    displacement = bent(bench.mesh)
    moved = bench.markers(displacement) - bench.markers(np.zeros_like(displacement))
    np.testing.assert_allclose(moved[:, :2], displacement[bench.mesh.marker_nodes], atol=1e-13)
    np.testing.assert_array_equal(bench.markers(displacement)[:, 2], 4.0)


def test_the_indenter_stands_on_the_contact(bench):
    displacement = np.zeros_like(bench.mesh.points)
    contact = np.unique(bench.mesh.boundary("contact"))
    displacement[contact] = (0.5, -2.0)
    indenter = next(shape for shape in bench.scene(displacement).shapes if shape.edges[:, :, 1].max() > 50)
    foot = indenter.edges[indenter.edges[:, 0, 1] <= -2.0, 0]
    left, right = np.add(Design().contact_ends, 0.5)
    np.testing.assert_allclose([foot[:, 0].min(), foot[:, 0].max()], [left, right], atol=1e-9)

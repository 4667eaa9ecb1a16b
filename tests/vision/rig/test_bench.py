"""The finger on the bench: what is drawn is what the truth says."""

import numpy as np
import pytest

from pinnray.geometry.finger.design import Design
from pinnray.vision.rig.bench import Bench
from pinnray.vision.rig.render import mean_light
from pinnray.vision.rig.shapes import Scene
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

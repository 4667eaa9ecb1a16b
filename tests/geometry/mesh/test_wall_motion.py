"""The motion of a mesh's nodes against the boundary of a finger that is drawn anew with other thicknesses."""

import numpy as np
import pytest

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh, signed_areas
from pinnray.geometry.mesh.wall_motion import WallMotion
from tests.solvers.conftest import bar_mesh

SETTINGS = MeshSettings(size=1.0)
CHANGE = 0.1


def distance_from_boundary(mesh: TriangleMesh, points: np.ndarray) -> np.ndarray:
    start, end = mesh.points[mesh.boundary_edges].transpose(1, 0, 2)
    along, offset = end - start, points[:, None] - start
    share = ((offset * along).sum(axis=2) / (along**2).sum(axis=1)).clip(0, 1)
    return np.linalg.norm(offset - share[..., None] * along, axis=2).min(axis=1)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["front_thickness", "back_thickness", "rib_thickness", "base_thickness"])
@pytest.mark.parametrize("fillet", [0.0, 0.8])
def test_the_moved_boundary_is_that_of_the_thicker_wall(name, fillet):
    """The ribs of the drawing are held where they are: a design places them along the walls' inner faces.

    The corners of the cavities are exact; a fillet of 0.8 mm keeps its radius in the design, in chords of
    the mesh's, which are some 0.03 mm from the arc.
    """
    drawn = Design(fillet_radius=fillet, rib_angle=0.0, rib_start=15.6, rib_pitch=13.6)
    thicker = drawn.replaced(**{name: getattr(drawn, name) + CHANGE})
    mesh, other = (finger_mesh(design, settings=SETTINGS) for design in (drawn, thicker))
    motion = WallMotion.of(mesh)
    changes = motion.changes({name: motion.thickness[motion.names.index(name)] + CHANGE})
    boundary = np.unique(mesh.boundary_edges)
    moved = distance_from_boundary(other, motion.moved(changes)[boundary])
    before = distance_from_boundary(other, mesh.points[boundary])
    assert before.max() > 0.4 * CHANGE
    assert moved.max() < (1e-9 if fillet == 0 else 0.035)
    assert (signed_areas(motion.moved(changes), mesh.triangles) > 0).all()


def test_gradients_and_shifts_are_those_of_the_nodal_motion(default_mesh):
    motion = WallMotion.of(default_mesh)
    np.testing.assert_allclose(motion.thickness, 2.0, rtol=0.02)
    changes = np.array([0.1, -0.2, 0.05, 1.0])
    centroids = default_mesh.at_centroids()
    step = 1e-3
    away = default_mesh.locate(centroids.points + np.array([step, 0.0]))
    same = away.cells == centroids.cells
    slope = (motion.shifts(away, changes) - motion.shifts(centroids, changes)) / step
    gradients = np.einsum("k,ktij->tij", changes, motion.gradients)
    assert same.mean() > 0.9
    np.testing.assert_allclose(slope[same], gradients[same][:, :, 0], atol=1e-9)


def test_the_outline_stays(default_mesh):
    motion = WallMotion.of(default_mesh)
    for name in ("base", "front", "back"):
        assert not motion.nodal[:, np.unique(default_mesh.boundary(name))].any()


def test_a_body_without_cavities_has_no_walls_to_move():
    assert WallMotion.of(bar_mesh(20.0, 2.0, 40, 4, contact=(18.0, 20.0))).names == ()

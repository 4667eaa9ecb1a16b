"""The mesh as a data type: checks, permutation, location, file."""

from pathlib import Path

import numpy as np
import pytest
from shapely.geometry import Point, Polygon

from pinnray.geometry import Design, OutsideBodyError, TriangleMesh
from pinnray.geometry.finger.section import cells
from pinnray.geometry.mesh.mesher import build_mesh
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.solvers.lagrange import LagrangeSpace
from tests.refusals.geometry import square


def test_arrays_cannot_be_written() -> None:
    mesh = square()
    for array in (mesh.points, mesh.triangles, mesh.boundary("base")):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_mesh_is_independent_of_the_arrays_it_was_made_from() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    mesh = square(points=points)
    points[0] = 99
    assert mesh.points[0].tolist() == [0, 0]


def test_edges_of_the_square() -> None:
    assert square().edges.tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]


def test_saved_mesh_is_read_back_the_same(default_mesh: TriangleMesh, tmp_path: Path) -> None:
    default_mesh.save(tmp_path / "mesh.npz")
    assert TriangleMesh.load(tmp_path / "mesh.npz").digest == default_mesh.digest


@pytest.mark.slow
def test_random_points_in_triangles_are_found(mesh: TriangleMesh) -> None:
    rng = np.random.default_rng(5)
    cells = rng.integers(len(mesh.triangles), size=2000)
    weights = rng.dirichlet([1, 1, 1], size=2000)
    points = np.einsum("nc,ncx->nx", weights, mesh.points[mesh.triangles[cells]])
    found = mesh.locate(points)
    assert (found.cells == cells).mean() > 0.999  # a point on an edge may go to either side
    np.testing.assert_allclose(
        np.einsum("nc,ncx->nx", found.barycentric, mesh.points[mesh.triangles[found.cells]]),
        points,
        atol=1e-9,
    )
    assert found.barycentric.min() >= -1e-9


def test_points_are_found_where_large_triangles_adjoin_many_small_ones() -> None:
    fine = 400  # a fan of slivers below one large triangle
    x = np.linspace(0, 1, fine + 1)
    points = np.concatenate([np.stack([x, np.zeros_like(x)], axis=1), [[0.5, 5.0], [0.5, -0.01]]])
    fan = [[k + 1, k, fine + 2] for k in range(fine)]
    upper = [[k, k + 1, fine + 1] for k in range(fine)]
    mesh = square(points=points, triangles=upper + fan, boundaries={}, marker_nodes=[], contact_node=0)
    rng = np.random.default_rng(8)
    cells = rng.integers(len(mesh.triangles), size=300)
    where = np.einsum("nc,ncx->nx", rng.dirichlet([1, 1, 1], size=300), points[mesh.triangles[cells]])
    assert (mesh.locate(where).cells == cells).all()


def test_every_node_is_found(mesh: TriangleMesh) -> None:
    found = mesh.locate(mesh.points)
    np.testing.assert_allclose(found.barycentric.max(axis=1), 1, atol=1e-9)


def test_points_are_inside_exactly_where_the_section_is(default_mesh: TriangleMesh) -> None:
    body = Polygon([(0, 0), (0, -30), (90, 0)], holes=cells(Design()))
    rng = np.random.default_rng(6)
    points = rng.uniform([-5, -35], [95, 5], size=(1500, 2))
    for point in points:
        inside = body.contains(Point(*point))
        if body.exterior.distance(Point(*point)) < 1e-6:
            continue
        try:
            default_mesh.locate(point[None])
            located = True
        except OutsideBodyError:
            located = False
        assert located == inside, point


def test_location_at_nodes_and_barycentric_points_agrees_with_search(default_mesh: TriangleMesh) -> None:
    mesh = default_mesh
    inner = mesh.at_barycentric([[0.6, 0.3, 0.1], [0.2, 0.2, 0.6]])
    assert len(inner) == 2 * len(mesh.triangles)
    found = mesh.locate(inner.points)
    assert (found.cells == inner.cells).all()
    np.testing.assert_allclose(found.barycentric, inner.barycentric, atol=1e-10)
    nodes = mesh.at_nodes()
    held = np.einsum("nc,ncx->nx", nodes.barycentric, mesh.points[mesh.triangles[nodes.cells]])
    np.testing.assert_allclose(held, mesh.points, atol=1e-12)


def test_points_of_another_mesh_of_a_round_body_are_located() -> None:
    """Chords of two meshes cut an arc differently: points between them count to the nearest triangle."""
    design = Design(fillet_radius=1.0, tip_radius=1.5)
    coarse = build_mesh(design, MeshSettings(size=1.0), across=1)
    fine = build_mesh(design, MeshSettings(size=0.35))
    for here, there in ((coarse, fine), (fine, coarse)):
        points = LagrangeSpace(here, 2).nodes
        with pytest.raises(OutsideBodyError):
            there.locate(points)
        found = here.locate_on(there, points)
        corners = there.points[there.triangles[found.cells]]
        np.testing.assert_allclose(np.einsum("nc,ncx->nx", found.barycentric, corners), points, atol=1e-12)
        assert found.barycentric.min() > -0.5
        with pytest.raises(OutsideBodyError, match="1 of 1 points"):
            here.locate_on(there, [[45.0, 0.5]])

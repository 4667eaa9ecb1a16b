"""Refinement: the same body, the same names, no worse angles."""

from collections import Counter

import numpy as np
import pytest

from pinnray.geometry import Design, TriangleMesh, finger_section
from pinnray.geometry.mesh.refinement import refined
from tests.meshes import smallest_angle


def some(mesh: TriangleMesh, share: float, seed: int = 0) -> np.ndarray:
    """A mask of that share of the triangles, drawn at random."""
    return np.random.default_rng(seed).random(len(mesh.triangles)) < share


def near(mesh: TriangleMesh, point: tuple[float, float], share: float) -> np.ndarray:
    """A mask of that share of the triangles, those nearest to a point."""
    distance = np.linalg.norm(mesh.points[mesh.triangles].mean(axis=1) - point, axis=1)
    return distance <= np.quantile(distance, share)


def test_the_body_and_its_boundaries_stay_the_same(case: str, mesh: TriangleMesh) -> None:
    """Without a section the polygon that the mesh is, is kept as it is."""
    finer = refined(mesh, some(mesh, 0.2))
    assert len(finer.triangles) > 1.2 * len(mesh.triangles)
    assert finer.areas.sum() == pytest.approx(mesh.areas.sum(), rel=1e-12)
    assert finer.areas.min() > 0
    for name in mesh.boundaries:
        assert finer.boundary_length(name) == pytest.approx(mesh.boundary_length(name), rel=1e-12)
    outside = {tuple(edge) for edge in finer.boundary_edges.tolist()}
    named = {tuple(edge) for edges in finer.boundaries.values() for edge in edges.tolist()}
    assert named <= outside  # in the direction that has the body on the left
    assert finer.markers.tolist() == mesh.markers.tolist()
    assert finer.points[finer.contact_node].tolist() == mesh.points[mesh.contact_node].tolist()


def test_no_node_hangs(default_mesh: TriangleMesh) -> None:
    """Every inner edge has two triangles, and no boundary appears inside."""
    finer = refined(default_mesh, some(default_mesh, 0.1))
    pairs = np.sort(finer.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    count = Counter(map(tuple, pairs.tolist()))
    assert set(count.values()) == {1, 2}
    length = sum(
        np.linalg.norm(finer.points[a] - finer.points[b]) for (a, b), many in count.items() if many == 1
    )
    edges = default_mesh.points[default_mesh.boundary_edges]
    assert length == pytest.approx(np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1).sum(), rel=1e-12)


def test_it_is_nested(default_mesh: TriangleMesh) -> None:
    """Every new triangle lies in one old triangle, and every old node is there under its number."""
    finer = refined(default_mesh, some(default_mesh, 0.1))
    old = len(default_mesh.points)
    assert finer.points[:old].tolist() == default_mesh.points.tolist()
    parent = default_mesh.locate(finer.points[finer.triangles].mean(axis=1)).cells
    corners = default_mesh.points[default_mesh.triangles[parent]]
    edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
    offset = finer.points[finer.triangles] - corners[:, None, 0]
    local = np.einsum("tij,tkj->tki", np.linalg.inv(edges), offset)
    assert local.min() > -1e-9
    assert local.sum(axis=2).max() < 1 + 1e-9


def test_marked_triangles_are_cut_in_four(default_mesh: TriangleMesh) -> None:
    marked = some(default_mesh, 0.05)
    finer = refined(default_mesh, marked)
    parent = default_mesh.locate(finer.points[finer.triangles].mean(axis=1)).cells
    count = np.bincount(parent, minlength=len(marked))
    assert set(count[marked].tolist()) == {4}
    assert count.min() == 1


def test_angles_stay_above_half_the_smallest(default_mesh: TriangleMesh) -> None:
    """Twenty rounds towards a corner and all over; the bound is Rosenberg's and Stenger's."""
    before, finer = smallest_angle(default_mesh), default_mesh
    for seed in range(20):
        finer = refined(finer, near(finer, (2.0, -2.0), 0.01) | some(finer, 0.005, seed))
    assert smallest_angle(finer) > 0.5 * before
    assert finer.areas.min() < 1e-9 * default_mesh.areas.min()  # so it was refined indeed


def test_it_is_the_same_every_time(default_mesh: TriangleMesh) -> None:
    one, two = (refined(default_mesh, some(default_mesh, 0.1)) for _ in range(2))
    assert one.digest == two.digest != default_mesh.digest


def test_nothing_marked_changes_no_geometry(default_mesh: TriangleMesh) -> None:
    same = refined(default_mesh, np.zeros(len(default_mesh.triangles), dtype=bool))
    assert same.points.tolist() == default_mesh.points.tolist()
    assert np.sort(same.triangles, axis=1).tolist() == np.sort(default_mesh.triangles, axis=1).tolist()


@pytest.mark.parametrize("case", ["fillets"])
def test_new_nodes_on_fillets_are_on_their_arcs(design: Design, mesh: TriangleMesh) -> None:
    """So the area goes to that with true arcs like h^2; on the chords it would stay."""
    section, meshes = finger_section(design), [mesh]
    for _ in range(2):
        everything = np.ones(len(meshes[-1].triangles), dtype=bool)
        meshes.append(refined(meshes[-1], everything, section))
    off = [mesh.areas.sum() - section.area for mesh in meshes]
    assert off[0] / off[1] == pytest.approx(4, rel=0.1)
    assert off[1] / off[2] == pytest.approx(4, rel=0.1)

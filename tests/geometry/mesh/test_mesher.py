"""The mesh against closed forms: area, boundaries, topology, thickness, markers, contact."""

from itertools import pairwise

import numpy as np
import pytest

from pinnray.geometry import Design, MeshSettings, TriangleMesh, UserError, elements_through_thickness
from pinnray.geometry import marker_positions as positions_of
from pinnray.geometry.mesh.boundary import boundary_loops
from pinnray.geometry.mesh.mesher import build_mesh


def test_area_is_that_of_the_section(design: Design, mesh: TriangleMesh) -> None:
    # Chords cut a little off the rounded corners of the cavities; straight edges leave nothing out.
    tolerance = 2e-3 if design.fillet_radius else 1e-12
    assert mesh.areas.sum() == pytest.approx(design.section.area, rel=tolerance)


def test_outline_is_base_front_and_back(mesh: TriangleMesh) -> None:
    named = np.concatenate([mesh.boundary(name) for name in ("base", "front", "back")])
    outline = boundary_loops(mesh)[0]
    assert sorted(np.unique(named)) == sorted(outline)
    assert len(named) == len(outline)


def test_boundary_edges_have_the_body_on_their_left(mesh: TriangleMesh) -> None:
    for name, outward in (("base", (-1, 0)), ("front", (0, 1)), ("contact", (0, 1))):
        ends = mesh.points[mesh.boundary(name)]
        along = ends[:, 1] - ends[:, 0]
        assert (along[:, 1] * outward[0] - along[:, 0] * outward[1] > 0).all()


def test_euler_characteristic_counts_the_ribs(design: Design, mesh: TriangleMesh) -> None:
    euler = len(mesh.points) - len(mesh.edges) + len(mesh.triangles)
    assert 1 - euler == design.rib_count + 1  # holes
    assert len(boundary_loops(mesh)) == design.rib_count + 2


def test_walls_and_ribs_measure_their_thickness(design: Design, mesh: TriangleMesh) -> None:
    _, *cells = boundary_loops(mesh)
    inner = mesh.points[np.concatenate(cells)]
    slope = design.base_width / design.height
    assert -inner[:, 1].max() == pytest.approx(design.front_thickness, rel=1e-12)
    assert inner[:, 0].min() == pytest.approx(design.base_thickness, rel=1e-12)
    over_back = (inner[:, 1] - slope * inner[:, 0] + design.base_width) / np.hypot(1, slope)
    assert over_back.min() == pytest.approx(design.back_thickness, rel=1e-12)
    angle = np.radians(design.rib_angle)
    across = mesh.points @ [np.cos(angle), np.sin(angle)]  # coordinate normal to the ribs
    for lower, upper in pairwise(cells):
        assert across[upper].min() - across[lower].max() == pytest.approx(design.rib_thickness, rel=1e-9)


def test_three_elements_lie_across_every_wall_and_rib(mesh: TriangleMesh) -> None:
    assert elements_through_thickness(mesh) >= 3


def test_markers_are_nodes_to_the_last_digit(design: Design, mesh: TriangleMesh) -> None:
    assert (mesh.markers == positions_of(design)).all()


def test_contact_ends_and_middle_are_nodes_of_the_front(design: Design, mesh: TriangleMesh) -> None:
    front = mesh.points[np.unique(mesh.boundary("front"))]
    for x in (*design.contact_ends, design.contact_abscissa):
        assert np.abs(front[:, 0] - x).min() < 1e-12
    assert mesh.points[mesh.contact_node].tolist() == [design.contact_abscissa, 0]
    contact = mesh.points[np.unique(mesh.boundary("contact")), 0]
    assert (contact.min(), contact.max()) == pytest.approx(design.contact_ends, abs=1e-12)


def test_triangles_are_well_shaped(mesh: TriangleMesh) -> None:
    corners = mesh.points[mesh.triangles]
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    # 2 * inradius / circumradius: 1 if equilateral, 0 if flat. The apex, at 18 degrees, is the worst.
    quality = 16 * mesh.areas**2 / (sides.prod(axis=1) * sides.sum(axis=1))
    assert quality.min() > 0.3
    assert np.median(quality) > 0.9


@pytest.fixture(scope="module")
def fine_mesh() -> TriangleMesh:
    return build_mesh(Design(), MeshSettings())


def test_default_settings_keep_the_size_in_the_walls_and_grow_in_the_tip(fine_mesh: TriangleMesh) -> None:
    ends = fine_mesh.points[fine_mesh.edges]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    middle = ends.mean(axis=1)
    walls, tip = middle[:, 0] < 70, middle[:, 0] > 80
    assert np.median(length[walls]) == pytest.approx(0.25, rel=0.15)
    assert length[walls].max() < 0.6
    assert 0.7 < length[tip].max() < 1.3
    assert elements_through_thickness(fine_mesh) >= 6


def test_meshing_twice_gives_the_same_mesh(fine_mesh: TriangleMesh) -> None:
    assert build_mesh(Design(), MeshSettings()).digest == fine_mesh.digest


@pytest.mark.parametrize(
    ("setting", "place"),
    [
        ("corner_size", (2.0, -2.0)),  # a cell's corner
        ("corner_size", (0.0, -30.0)),  # where the clamp ends
        ("contact_size", (34.0, 0.0)),  # where the contact ends
        ("contact_size", (35.0, 0.0)),  # where a point load acts
    ],
)
def test_grading_reaches_its_size_where_asked_and_only_there(setting, place):
    mesh = build_mesh(Design(), MeshSettings(size=0.6, **{setting: 0.02}))
    ends = mesh.points[mesh.edges]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    away = np.linalg.norm(ends.mean(axis=1) - place, axis=1)
    assert length[away < 0.02].max() < 0.04
    far = np.linalg.norm(mesh.points[mesh.edges].mean(axis=1) - [85, -1], axis=1) < 2
    assert length[far].min() > 0.3


def random_design(seed: int) -> Design:
    """A finger drawn evenly from wide ranges; draws that break a rule are drawn again."""
    rng = np.random.default_rng(seed)
    ranges = {
        "height": (40, 160), "base_width": (15, 60), "rib_angle": (-40, 50), "tip_length": (5, 60),
        "rib_thickness": (0.6, 5), "front_thickness": (0.8, 5), "back_thickness": (0.8, 5),
        "base_thickness": (0.5, 8), "fillet_radius": (0, 1.5), "contact_position": (2, 100),
        "contact_width": (0.2, 12), "marker_diameter": (0.3, 2),
    }  # fmt: skip
    while True:
        values = {name: rng.uniform(*ends) for name, ends in ranges.items()}
        values["fillet_radius"] *= rng.integers(2)
        values |= {"rib_count": int(rng.integers(0, 12)), "marker_count": int(rng.integers(1, 14))}
        layout = str(rng.choice(["front", "joints"]))
        try:
            return Design(**values, marker_layout=layout)
        except UserError:
            continue


@pytest.mark.parametrize("seed", [4, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (0, 1))])
def test_random_admissible_design_meshes(seed: int) -> None:
    design = random_design(seed)
    mesh = build_mesh(design, MeshSettings(size=2, coarsening=2))
    assert mesh.areas.sum() == pytest.approx(design.section.area, rel=5e-3 if design.fillet_radius else 1e-11)
    assert len(boundary_loops(mesh)) == design.rib_count + 2
    assert elements_through_thickness(mesh) >= 3
    assert mesh.boundary_length("contact") == pytest.approx(design.contact_width)

"""Fingers with a tilted base, a round tip, placed ribs and a foot: closed forms, mesh and messages."""

from itertools import pairwise

import numpy as np
import pytest
import shapely

from pinnray.geometry import Design, MeshSettings, load_design
from pinnray.geometry.finger.section import apex_angle, base_corners, cells, rib_axes
from pinnray.geometry.mesh.boundary import boundary_loops
from pinnray.geometry.mesh.mesher import build_mesh
from tests.meshes import corner_area

TILTED = Design(base_tilt=9.9)
COARSE = MeshSettings(size=1.0)


def test_a_tilted_base_has_its_width_and_angle_and_moves_the_apex_angle() -> None:
    front, back = base_corners(TILTED)
    assert np.hypot(*(back - front)) == pytest.approx(30, rel=1e-14)
    assert np.degrees(np.arctan2(back[0], -back[1])) == pytest.approx(9.9, rel=1e-12)
    assert np.tan(apex_angle(TILTED)) == pytest.approx(-back[1] / (90 - back[0]), rel=1e-12)


def test_base_wall_and_tip_line_follow_the_tilt() -> None:
    first, last = cells(TILTED)[0], cells(TILTED)[-1]
    for side in (first[1] - first[0], last[2] - last[3]):
        assert np.degrees(np.arctan2(side[0], -side[1])) == pytest.approx(9.9, rel=1e-9)
    base = shapely.LineString(base_corners(TILTED))
    assert base.distance(shapely.Polygon(first)) == pytest.approx(2, rel=1e-9)


@pytest.mark.parametrize(
    ("reference", "angle"),
    [
        ("front", 20.0),  # from the front wall's normal
        ("base", 29.9),  # from the base line, which is tilted by 9.9 degrees
    ],
)
def test_rib_angle_counts_from_its_reference(reference: str, angle: float) -> None:
    axes = rib_axes(TILTED.replaced(rib_reference=reference))
    run, drop = axes[:, 1, 0] - axes[:, 0, 0], axes[:, 0, 1] - axes[:, 1, 1]
    np.testing.assert_allclose(np.degrees(np.arctan2(run, drop)), angle, atol=1e-10)


def test_without_tilt_both_references_are_one_finger() -> None:
    assert Design(rib_reference="base").section.digest == Design().section.digest


def test_ribs_stand_where_they_are_placed() -> None:
    design = Design(rib_start=12.0, rib_pitch=14.0)
    feet = [(before[3, 0] + after[0, 0]) / 2 for before, after in pairwise(cells(design))]
    np.testing.assert_allclose(feet, [12, 26, 40, 54], rtol=1e-12)


def test_a_round_tip_takes_the_corner_off_the_apex() -> None:
    sharp, blunt = Design(), Design(tip_radius=1.5)
    cut = corner_area(apex_angle(sharp), 1.5)
    assert sharp.section.area - blunt.section.area == pytest.approx(cut, rel=1e-9)
    extreme = 90 * np.cos(0) - 1.5 / np.tan(apex_angle(sharp) / 2) + 1.5 * np.sin(0)
    assert blunt.section.bounds[1, 0] == pytest.approx(extreme + 1.5, rel=1e-12)


def test_a_foot_adds_its_block_less_its_slot() -> None:
    plain = Design()
    foot = Design(foot_height=8, slot_width=20, slot_height=3, slot_opening=12, lip_thickness=2)
    assert foot.section.area - plain.section.area == pytest.approx(8 * 30 - 20 * 3 - 12 * 2, rel=1e-12)
    clamped = sum(loop.lengths[which] for loop, which in foot.section.named("base"))
    assert clamped == pytest.approx(30 - 12, rel=1e-12)
    assert foot.section.bounds[0, 0] == pytest.approx(-8, rel=1e-12)


@pytest.mark.parametrize(
    "design",
    [TILTED, Design(tip_radius=1.5), Design(foot_height=6), Design(base_tilt=-8), load_design("csiro")],
    ids=["tilted", "round tip", "solid foot", "tilted back", "csiro"],
)
def test_the_mesh_has_every_named_boundary_on_its_curve(design: Design) -> None:
    mesh, section = build_mesh(design, COARSE), design.section
    assert mesh.areas.sum() == pytest.approx(section.area, rel=1e-3 if design.tip_radius else 1e-12)
    for name in set(section.outline.names):
        expected = sum(loop.lengths[which] for loop, which in section.named(name))
        # The arc of the tip is a polygon in the mesh.
        assert mesh.boundary_length(name) == pytest.approx(expected, rel=3e-2 if name == "tip" else 1e-12)
        nodes = mesh.points[np.unique(mesh.boundary(name))]
        assert np.abs(section.clearance(nodes)).max() < 2e-5  # arcs are polygons within 1e-5 in `clearance`
    assert len(boundary_loops(mesh)) == 1 + len(section.cavities)
    assert mesh.boundary_length("contact") == pytest.approx(design.contact_width, rel=1e-12)

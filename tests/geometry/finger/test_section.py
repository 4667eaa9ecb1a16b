"""Closed forms of the section, against shapely and against sums by hand."""

from itertools import pairwise

import numpy as np
import pytest
from shapely.geometry import LineString, Point, Polygon

from pinnray.geometry import Design, finger_section, marker_positions
from pinnray.geometry.finger.section import cells, rib_axes, rib_feet

THICKNESS = {"front": "front_thickness", "back": "back_thickness", "base": "base_thickness"}


def as_shapely(design: Design) -> Polygon:
    """The body, with fillets by shapely's own offsetting."""
    body = Polygon([(0, 0), (0, -design.base_width), (design.height, 0)])
    for corners in cells(design):
        cell = Polygon(corners)
        radius = design.fillet_radius
        if radius:
            cell = cell.buffer(-radius, join_style="mitre").buffer(radius, quad_segs=4000)
        body = body.difference(cell)
    return body


def test_area_and_perimeter_agree_with_shapely(design: Design) -> None:
    section, body = finger_section(design), as_shapely(design)
    assert section.area == pytest.approx(body.area, rel=1e-7)
    perimeter = sum(loop.lengths.sum() for loop in section.loops)
    assert perimeter == pytest.approx(body.length, rel=1e-7)


def test_section_has_one_cell_more_than_ribs_and_none_touches_another(design: Design) -> None:
    found = [Polygon(corners) for corners in cells(design)]
    assert len(found) == design.rib_count + 1
    outer = Polygon(design.section.outline.points)
    assert all(cell.is_valid and cell.exterior.is_ccw for cell in found)
    assert all(outer.contains(cell) for cell in found)
    assert all(first.distance(second) > 0 for first, second in pairwise(found))


def test_walls_have_their_thickness_normal_to_their_faces(design: Design) -> None:
    faces = {
        name: LineString(loop.ends[which]) for name in THICKNESS for loop, which in design.section.named(name)
    }
    found = [Polygon(corners) for corners in cells(design)]
    for name, parameter in THICKNESS.items():
        nearest = min(cell.distance(faces[name]) for cell in found)
        assert nearest == pytest.approx(getattr(design, parameter), rel=1e-12)
    for first, second in pairwise(found):
        assert first.distance(second) == pytest.approx(design.rib_thickness, rel=1e-9)


def test_cavity_ends_where_the_tip_block_begins(design: Design) -> None:
    assert max(corners[:, 0].max() for corners in cells(design)) == pytest.approx(
        design.height - design.tip_length
    )


@pytest.mark.parametrize(
    ("angle", "leans"),
    [
        (20, 1),  # toward the tip: x grows from the front wall to the back wall
        (-15, -1),
        (0, 0),  # along the front wall's normal
    ],
)
def test_ribs_slope_by_their_angle(angle: float, leans: int) -> None:
    axes = rib_axes(Design(rib_angle=angle))
    run, drop = axes[:, 1, 0] - axes[:, 0, 0], axes[:, 0, 1] - axes[:, 1, 1]
    assert np.sign(np.round(run, 12)).tolist() == [leans] * 4
    np.testing.assert_allclose(np.degrees(np.arctan2(run, drop)), angle, atol=1e-12)


def test_ribs_are_evenly_spaced_along_the_front_wall() -> None:
    np.testing.assert_allclose(rib_feet(Design()), 2 + 68 / 5 * np.arange(1, 5), rtol=1e-14)


def test_front_markers_are_evenly_spaced_on_the_centre_line() -> None:
    markers = marker_positions(Design(marker_layout="front"))
    np.testing.assert_allclose(markers[:, 0], np.arange(9, 90, 9))
    np.testing.assert_allclose(markers[:, 1], -1)


@pytest.mark.parametrize("angle", [20, -15])  # the back joint of a rib lies nearer the tip, nearer the base
def test_joint_markers_lie_on_centre_lines_in_order_and_the_last_on_the_bisector(angle: float) -> None:
    markers = marker_positions(Design(rib_angle=angle))
    assert markers.shape == (9, 2)
    assert (np.diff(markers[:, 0]) > 0).all()
    back = LineString([(0, -30), (90, 0)])
    depths = np.array([min(-y, back.distance(Point(x, y))) for x, y in markers])
    np.testing.assert_allclose(depths[:-1], 1, atol=1e-12)
    assert -markers[-1, 1] == pytest.approx(back.distance(Point(*markers[-1])))


def test_every_marker_lies_in_the_material(design: Design) -> None:
    body = as_shapely(design)
    for x, y in marker_positions(design):
        assert body.contains(Point(x, y).buffer(design.marker_radius))

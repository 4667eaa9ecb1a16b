"""Wall thickness against closed forms."""

import numpy as np
import pytest

from pinnray.geometry.section.loop import Loop
from pinnray.geometry.section.section import Section
from pinnray.geometry.section.thickness import cavity_widths, through, wall_thickness


def disc(radius: float, pieces: int = 2) -> Loop:
    angles = 2 * np.pi * np.arange(pieces) / pieces
    corners = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return Loop(corners, np.full(pieces, np.tan(np.pi / 2 / pieces)), ("",) * pieces)


def rectangle(x: float, y: float, width: float, height: float) -> Loop:
    return Loop.polygon([[x, y], [x + width, y], [x + width, y + height], [x, y + height]])


@pytest.mark.parametrize("pieces", [2, 3, 8])
def test_ring(pieces):
    ring = Section(disc(10, pieces), (disc(7, pieces).reversed(),))
    points, thickness = wall_thickness(ring, 0.5)
    assert thickness == pytest.approx(3, abs=1e-9)
    assert len(points) > 2 * np.pi * 17 / 0.5


def test_disc_is_as_thick_as_its_diameter():
    assert wall_thickness(Section(disc(4)), 0.3)[1] == pytest.approx(8, abs=1e-9)


def test_beam():
    points, thickness = wall_thickness(Section(rectangle(0, 0, 50, 4)), 1.0)
    long = np.isclose(points[:, 1] % 4, 0)
    assert thickness[long] == pytest.approx(4)
    assert thickness[~long] == pytest.approx(50)


def test_wedge_is_as_thick_as_its_tangent_and_has_no_wall():
    length, height = 40.0, 10.0
    wedge = Section(Loop.polygon([[0, 0], [0, -height], [length, 0]]))
    crossing = through(wedge, [[10.0, 0.0], [30.0, 0.0]], [[0.0, -1.0], [0.0, -1.0]])
    assert crossing.lengths == pytest.approx([7.5, 2.5])
    assert len(wall_thickness(wedge, 0.5)[0]) == 0  # every ray ends beyond a sharp corner


def test_wall_between_outline_and_cavity():
    frame = Section(rectangle(0, 0, 20, 10), (rectangle(1, 2, 16, 5).reversed(),))
    points, thickness = wall_thickness(frame, 0.25)
    assert thickness.min() == pytest.approx(1)  # left
    beside = (points[:, 0] > 1) & (points[:, 0] < 17)
    assert thickness[beside & (points[:, 1] == 10)] == pytest.approx(3)
    assert thickness[beside & (points[:, 1] == 0)] == pytest.approx(2)


def test_slot_in_the_outline_leaves_a_thin_wall_to_the_same_curve():
    slit = Section(Loop.polygon([[0, 0], [10, 0], [10, 5], [6, 5], [6, 0.1], [5, 0.1], [5, 5], [0, 5]]))
    assert wall_thickness(slit, 0.5)[1].min() == pytest.approx(0.1)


def test_ray_from_inside_ends_on_the_arc():
    crossing = through(Section(disc(2)), [[0.5, 0.0]], [[0.6, 0.8]])
    assert crossing.lengths == pytest.approx(-0.3 + np.sqrt(0.09 + 3.75))


def test_the_width_of_a_cavity_is_that_of_its_own_walls():
    wide, round_one = rectangle(2, 2, 15, 26).reversed(), disc(3)
    hole = Loop(round_one.points + np.array([30, 15]), round_one.bulges, round_one.names).reversed()
    body = Section(rectangle(0, 0, 40, 30), (wide, hole))
    points, widths = cavity_widths(body, 0.5)
    assert widths[points[:, 0] < 20].min() == pytest.approx(15)
    assert widths[points[:, 0] > 20] == pytest.approx(6)


def test_a_body_without_cavities_has_no_widths():
    points, widths = cavity_widths(Section(disc(2)), 0.5)
    assert (len(points), len(widths)) == (0, 0)

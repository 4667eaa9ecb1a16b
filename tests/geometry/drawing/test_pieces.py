"""Curves as circular arcs, and loose pieces as closed curves."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import cKDTree

from pinnray.geometry.drawing.formats.closed_loops import closed_loops, straightened
from pinnray.geometry.drawing.formats.pieces import DEVIATION, arcs_along, line
from pinnray.geometry.section.loop import Loop
from pinnray.runtime.errors import UserError


def ellipse(parameters):
    return np.stack([30 * np.cos(parameters), 10 * np.sin(parameters)], axis=1)


def circle(parameters):
    return np.stack([5 + np.cos(parameters), 2.5 + np.sin(parameters)], axis=1)


@pytest.mark.parametrize(
    ("sweep", "bulges"), [(np.pi / 2, [np.tan(np.pi / 8)]), (-np.pi, [-1]), (2 * np.pi, [1, 1])]
)
def test_an_arc_of_a_circle_is_exact_and_at_most_half_of_it(sweep, bulges):
    assert [piece.bulge for piece in arcs_along(circle, 0, sweep, "")] == pytest.approx(bulges, rel=1e-12)


def test_arcs_stay_near_the_ellipse():
    loop = closed_loops(list(arcs_along(ellipse, 0, 2 * np.pi, ""))).loops[0]
    points = np.concatenate([loop.along(k, np.linspace(0, 1, 50)) for k in range(len(loop.points))])
    gaps, _ = cKDTree(ellipse(np.linspace(0, 2 * np.pi, 200_001))).query(points)
    assert 1e-5 < gaps.max() <= DEVIATION  # approximated, and no more than needed
    assert len(loop.points) < 100
    assert loop.area == pytest.approx(np.pi * 300, rel=1e-5)


def test_pieces_in_any_order_and_direction_are_chained():
    corners = np.array([[0, 0], [10, 0], [10, 5], [0, 5]], dtype=float)
    pieces = [
        line(corners[2], corners[1], "back"),  # against the others
        line(corners[0], corners[1], ""),
        *arcs_along(circle, 0, 2 * np.pi, "hole"),
        line(corners[3] + [0, 4e-4], corners[0], "base"),  # an end within the tolerance
        line(corners[2], corners[3], ""),
    ]
    first, second = sorted(closed_loops(pieces).loops, key=lambda loop: -abs(loop.area))
    assert abs(first.area) == pytest.approx(50, abs=5e-3)
    assert sorted(first.names) == ["", "", "back", "base"]
    assert abs(second.area) == pytest.approx(np.pi)


def test_a_line_on_top_of_the_boundary_names_the_part_under_it():
    corners = [[0, 0], [10, 0], [10, 5], [0, 5], [0, 0]]
    pieces = [line(a, b, "outline") for a, b in pairwise(corners)]
    marked = closed_loops([*pieces, line([7, 5], [4, 5], "contact")], frozenset({"contact"})).loops[0]
    named = [marked.ends[k].tolist() for k in marked.pieces("contact")]
    assert named == [[[7.0, 5.0], [4.0, 5.0]]]
    assert marked.area == pytest.approx(50)
    with pytest.raises(UserError, match="off every boundary"):
        closed_loops([*pieces, line([7, 4], [4, 4], "contact")], frozenset({"contact"}))


def test_corners_in_a_straight_line_go():
    loop = Loop.polygon([[0, 0], [3, 0], [10, 0], [10, 5], [0, 5]], ["a", "a", "", "", ""])
    assert straightened(loop).points.tolist() == [[0, 0], [10, 0], [10, 5], [0, 5]]
    assert len(straightened(loop.named(1, "b")).points) == 5  # two names stay two pieces


@pytest.mark.parametrize(
    ("point", "piece", "fraction", "distance"),
    [
        ((5, -1), 0, 0.5, 1),  # beside the line
        ((-3, -4), 0, 0, 5),  # beyond its end
        ((5, 7), 1, 0.5, 2),  # outside the arc
        ((5, 3), 1, 0.5, 2),  # inside it
    ],
)
def test_nearest_place(point, piece, fraction, distance):
    half_disc = Loop(np.array([[0, 0], [10, 0.0]]), np.array([0, 1.0]), ("", ""))
    found = half_disc.places(np.array([point], dtype=float))
    assert found.pieces == [piece]
    assert [found.shares[0], found.distances[0]] == pytest.approx([fraction, distance])

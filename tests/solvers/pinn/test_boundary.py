"""The boundary of any body: its loops, widths across walls and slots, re-entrant points, points along it."""

import numpy as np
import pytest

from pinnray.geometry.mesh.boundary import (
    boundary_loops,
    boundary_widths,
    evenly_spaced_points,
    mean_thickness,
    re_entrant_points,
    walls_and_ribs,
)
from pinnray.solvers.pinn.finite_basis.point_spacing import NARROW, PointSpacing
from pinnray.solvers.problem import Problem
from tests.solvers.bodies import BODIES, body_mesh


@pytest.mark.parametrize("body", BODIES)
def test_the_outline_is_the_first_loop(body):
    mesh = body_mesh(body, 1.0)
    outline, *cavities = boundary_loops(mesh)
    assert len(cavities) == len(BODIES[body]()[0].cavities)
    assert np.isin(mesh.boundary("front"), outline).all()


def test_walls_beside_a_slot_and_the_slot_itself_have_their_widths():
    """In a T-slot of 4 by 11 mm with an opening of 4 mm; in one and the same outline."""
    mesh = body_mesh("feet and slot", 0.5)
    points, widths = boundary_widths(mesh)
    x, y = points.T
    end = (np.abs(x - 25) < 1e-9) & (y > -19.5) & (y < -16.5)
    assert widths[end] == pytest.approx(11.0, rel=1e-6)
    foot = (np.abs(y + 6) < 1e-9) & (x > 0.5) & (x < 4.5)
    assert widths[foot] == pytest.approx(6.0, rel=1e-6)
    opening = (np.abs(x - 28) < 1e-9) & (y < -20.5)
    assert widths[opening] == pytest.approx(4.0, rel=1e-6)
    under = (np.abs(y + 16) < 1e-9) & (x > 32.5) & (x < 35.5)
    assert widths[under] == pytest.approx(4.0, rel=1e-6)


def test_a_ring_is_as_wide_as_its_wall_and_a_beam_has_its_height():
    ring, beam = body_mesh("ring", 0.5), body_mesh("beam", 0.5)
    assert boundary_widths(ring)[1] == pytest.approx(3.0, rel=0.02)
    points, widths = boundary_widths(beam)
    assert np.isinf(widths).all(), "its height of 4 mm is more than the mean thickness"
    assert mean_thickness(beam) == pytest.approx(2 * 240 / 128)
    assert len(points) == len(widths)


def test_the_spacing_has_no_jumps_beside_a_narrow_slit():
    """The slit is 0.4 mm wide in a bar of 10 mm."""
    mesh = body_mesh("notched", 0.4)
    spacing = PointSpacing.of(Problem(mesh), wall=0.8, corner=0.02, growth=0.55)
    y = np.full(50, -8.0)
    x = np.linspace(43.4, 48.0, 50)
    found = spacing.at(np.column_stack([x, y]))
    assert found[0] == pytest.approx(NARROW * 0.8 * 0.4, rel=0.6)
    assert (np.diff(found) <= 0.55 * np.diff(x) + 1e-9).all()


def test_a_finely_meshed_round_notch_is_re_entrant():
    """Its edges turn by 3.6 degrees each, less than a corner; its radius is below the mean thickness."""
    mesh = body_mesh("notched", 0.25)
    sharp, round_, radii = re_entrant_points(mesh)
    on_notch = np.abs(np.linalg.norm(round_ - [30, -10], axis=1) - 4) < 1e-6
    assert on_notch.all()
    assert on_notch.sum() > 30
    assert radii == pytest.approx(4.0, rel=0.01)
    for corner in ([15, -5], [43, -4], [43.4, -4], [0, 0], [0, -10]):
        assert np.linalg.norm(sharp - corner, axis=1).min() < 1e-9


@pytest.mark.parametrize(
    ("body", "length"), [("beam", 4.0), ("feet and slot", 12.0), ("arch", 8.0), ("ring", 20.94)]
)
def test_points_are_spread_evenly_over_all_pieces_of_a_base(body, length):
    mesh = body_mesh(body, 1.0)
    points = evenly_spaced_points(mesh, "base", 201)
    nodes = mesh.points[np.unique(mesh.boundary("base"))]
    away = np.linalg.norm(points[:, None] - nodes, axis=2).min(axis=1)
    assert away.max() < 0.6, "elements of 1 mm"
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert np.median(steps) == pytest.approx(length / 200, rel=2e-3)
    pieces = {"beam": 1, "ring": 1}.get(body, 2)
    assert (steps > 1.5 * length / 200).sum() == pieces - 1


@pytest.mark.parametrize("body", ["ring", "beam", "notched"])
def test_a_body_without_a_back_has_no_walls_and_ribs(body):
    assert not any(mask.any() for mask in walls_and_ribs(body_mesh(body, 1.0)).values())


def test_walls_and_ribs_have_the_areas_of_the_drawing(medium_mesh):
    """Walls of 2 mm beside cavities that end 2 mm from the base; ribs of 2 mm, 20 degrees from the normal."""
    parts = walls_and_ribs(medium_mesh)
    areas = {name: medium_mesh.areas[mask].sum() for name, mask in parts.items()}
    assert not np.any(np.sum(list(parts.values()), axis=0) > 1)
    assert medium_mesh.at_centroids().points[parts["front"], 1].min() > -2
    # From the base wall to the tip, 2 to 70 mm and a little less: triangles are taken whole.
    assert areas["front"] == pytest.approx(2 * 67, rel=0.03)
    assert areas["back"] == pytest.approx(2 * 68 / np.cos(np.arctan(1 / 3)), rel=0.03)
    # Four ribs between walls that leave 26 mm at the base: lengths fall with the distance from it.
    assert 80 < areas["rib"] < 130

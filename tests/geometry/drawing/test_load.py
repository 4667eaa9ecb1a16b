"""Fingers from drawings: proposals, placement, description, and meshes of them."""

import functools
import json
import pickle

import ezdxf
import numpy as np
import pytest

from pinnray.geometry import MeshSettings, UserError
from pinnray.geometry.cache import expected_triangles, finger_mesh
from pinnray.geometry.drawing.checks import least_thickness
from pinnray.geometry.drawing.description import Description, load_description
from pinnray.geometry.drawing.drawn_finger import DrawnFinger, description_lines
from pinnray.geometry.drawing.load import finger_from_file
from pinnray.geometry.mesh.mesher import build_mesh
from tests.geometry.drawing.files import BEAM, CSIRO, FINRAY, rectangle, write_beam_mesh, write_dxf, write_svg

FILES = [*sorted(FINRAY.glob("*.stp")), CSIRO]
IDS = [path.stem for path in FILES]


@functools.cache
def finger_in(path):
    return finger_from_file(path)


def clamped_length(finger):
    return sum(loop.lengths[which] for loop, which in finger.section.named("base"))


@pytest.mark.parametrize("path", FILES, ids=IDS)
def test_frame(path):
    finger = finger_in(path)
    outline = finger.section.outline
    assert finger.section.front_point(finger.contact_abscissa)[1] == pytest.approx(0, abs=1e-9)
    base = np.concatenate([outline.ends[which] for which in outline.pieces("base")])
    top = base[np.isclose(base[:, 0], 0, atol=1e-9)]
    assert len(top)
    front = np.concatenate([outline.ends[which] for which in outline.pieces("front")])
    assert (np.diff(outline.ends[list(outline.pieces("front")), :, 0], axis=1) < 0).all()
    assert front[:, 0].min() - 1e-9 <= finger.contact_ends[0] < finger.contact_ends[1] <= front[:, 0].max()
    assert finger.section.bounds[1, 0] > 0.8 * np.ptp(finger.section.bounds[:, 0])  # the base is at the left


@pytest.mark.parametrize(
    ("path", "clamp", "contact", "diameter"),
    [
        (FILES[0], 10.0, (30.3, 0.0), 1.6),  # both feet; the middle of 7.8 to 52.8
        (FILES[1], 10.0, (30.3, 0.0), 1.6),  # the feet, not the equally wide tip
        (FILES[2], 10.0, (30.484, 0.0), 0.47),  # walls of 0.6 mm
        (CSIRO, 19.0, (23.077, 5.337), 1.6),  # the bottoms of two hooks
    ],
    ids=IDS,
)
def test_proposals(path, clamp, contact, diameter):
    finger = finger_in(path)
    assert set(finger.sources.values()) == {"proposed", "drawn"}
    assert clamped_length(finger) == pytest.approx(clamp, abs=1e-3)
    placed = finger.placement.inverse([[finger.contact_abscissa, 0]])[0]
    assert placed == pytest.approx(contact, abs=1e-3)
    assert finger.marker_diameter == diameter
    assert len(finger.markers) == 9
    assert (finger.section.clearance(finger.markers) >= finger.marker_radius).all()
    assert 3 <= (finger.markers[:, 1] > -3).sum() <= 6  # on the front and elsewhere
    assert finger_from_file(path).digest == finger.digest  # the same every time


def test_markers_leave_a_sharp_tip_out(tmp_path):
    finger = finger_from_file(write_dxf(tmp_path / "wedge.dxf", [[(0, 0), (60, 0), (0, 20)]]))
    assert finger.marker_diameter > 0.5
    assert (finger.markers[:, 1] > -3).sum() >= 3


def test_a_body_held_at_both_ends_has_markers_on_both_sides(tmp_path):
    path = write_dxf(tmp_path / "beam.dxf", [BEAM])
    finger = finger_from_file(path, Description(clamp=[[[0, 0], [0, -10]], [[100, 0], [100, -10]]]))
    assert sorted(set(finger.markers[:, 1])) == pytest.approx([-8, -2])
    assert len(finger.markers) == 9


def test_a_body_without_flat_end_or_straight_side_must_be_given_clamp_and_contact(tmp_path):
    path = write_svg(tmp_path / "drop.svg", '<path d="M5 30 C 5 5 60 5 95 25 L 95 35 C 60 40 5 55 5 30 z"/>')
    with pytest.raises(UserError, match="it has no straight side to be touched; give contact = "):
        finger_from_file(path)
    path = write_svg(tmp_path / "disc.svg", '<circle cx="50" cy="30" r="20"/>')
    with pytest.raises(UserError, match="it has no flat end to be clamped; give clamp = "):
        finger_from_file(path, Description(contact=[50, -10]))


@pytest.mark.parametrize("turn", [0, 37, 90, 180, 271])
@pytest.mark.parametrize("mirror", [1, -1])
def test_the_frame_does_not_depend_on_the_file_s(tmp_path, turn, mirror):
    """A wedge drawn anywhere, with clamp and contact given there, is the same finger."""
    angle = np.radians(turn)
    turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    matrix = turned @ np.diag([1, mirror])

    def there(points):
        return (np.asarray(points, dtype=float) @ matrix.T + [12, -7]).tolist()

    curves = [there([(0, 0), (0, -30), (90, 0)]), there(rectangle(5, -20, 10, 15))]
    clamp, (contact,) = there([(0, 0), (0, -30)]), there([(35, 0)])
    description = Description(clamp=clamp, contact=contact, markers=there([(40, -3), (20, -2)]))
    finger = finger_from_file(write_dxf(tmp_path / "wedge.dxf", curves), description)
    assert finger.contact_abscissa == pytest.approx(35)
    assert finger.markers == pytest.approx(np.array([[20, -2], [40, -3]]))
    front = list(finger.section.outline.pieces("front"))
    assert finger.section.outline.points[front] == pytest.approx(np.array([[90, 0]]))
    assert finger.placement.inverse(finger.markers) == pytest.approx(np.array(there([(20, -2), (40, -3)])))
    assert finger.sources["clamp"] == finger.sources["contact"] == finger.sources["markers"] == "given"


def test_ring(tmp_path):
    document = ezdxf.new(units=4)
    for radius in (20, 15):
        document.modelspace().add_circle((3, 4), radius)
    document.saveas(tmp_path / "ring.dxf")
    description = Description(clamp=[[-7, 4 - np.sqrt(300)], [13, 4 - np.sqrt(300)]], contact=[3, 24])
    finger = finger_from_file(tmp_path / "ring.dxf", description)
    outline = finger.section.outline
    assert clamped_length(finger) == pytest.approx(2 * np.pi * 20 / 6)  # the shorter way
    front = np.concatenate([outline.ends[which] for which in outline.pieces("front")])
    reach = 2 * 20 * np.sin(np.radians(60))
    assert np.ptp(front[:, 0]) == pytest.approx(reach, rel=1e-6)
    assert finger.section.front_point(finger.contact_abscissa)[1] == pytest.approx(0, abs=1e-9)
    assert least_thickness(finger.section)[0] == pytest.approx(5)
    assert (finger.markers[:, 1] < -10).any()  # around it, not only near the contact
    moved = finger.at_contact(finger.contact_abscissa + 5)
    assert moved.section.front_point(moved.contact_abscissa)[1] == pytest.approx(np.sqrt(375) - 20, abs=0.02)
    assert moved.digest != finger.digest
    with pytest.raises(UserError, match="not on the front face"):
        finger.at_contact(finger.contact_abscissa + 30)
    mesh = build_mesh(finger, MeshSettings(size=1.5, coarsening=2))
    assert mesh.areas.sum() == pytest.approx(np.pi * (400 - 225), rel=1e-2)


def test_labels_of_the_file_beat_proposals_and_the_description_beats_both(tmp_path):
    document = ezdxf.new(units=4)
    layers = ("0", "0", "clamp", "0")  # the right end
    for start, end, layer in zip(BEAM, BEAM[1:] + BEAM[:1], layers, strict=True):
        document.modelspace().add_line(start, end, dxfattribs={"layer": layer})
    document.modelspace().add_line((40, -10), (44, -10), dxfattribs={"layer": "contact"})
    for x in (10, 30, 50):
        document.modelspace().add_point((x, -4), dxfattribs={"layer": "markers"})
    path = tmp_path / "beam.dxf"
    document.saveas(path)
    drawn = finger_from_file(path)
    assert drawn.contact_abscissa == pytest.approx(58)  # from the right end
    assert drawn.contact_width == pytest.approx(4)
    assert drawn.markers == pytest.approx(np.array([[50, -6], [70, -6], [90, -6]]))
    assert not drawn.placement.mirrored  # half a turn
    (tmp_path / "beam.toml").write_text('clamp = [[0, 0], [0, -10]]\ndepth = 7\nname = "held-left"')
    given = finger_from_file(path)
    assert given.contact_abscissa == pytest.approx(42)
    assert (given.name, given.depth) == ("held-left", 7)
    assert given.sources["clamp"] == "given"
    assert given.sources["contact"] == "drawn"


def test_units_apply_to_the_description(tmp_path):
    path = write_dxf(tmp_path / "beam.dxf", [[(x / 1000, y / 1000) for x, y in BEAM]])
    lines = ['units = "m"', "contact = [0.04, 0]", "depth = 0.01", "markers = 5", "contact_width = 0.003"]
    finger = finger_from_file(path, load_description(None, lines))
    assert finger.section.area == pytest.approx(1000)
    assert (finger.contact_abscissa, finger.contact_width, finger.depth) == pytest.approx((40, 3, 10))
    assert len(finger.markers) == 5


@pytest.mark.parametrize(
    ("units", "lines"),
    [
        (1, []),  # inches by the header
        (0, ['units = "cm"']),  # a unit that only the description knows
    ],
)
def test_the_lines_of_a_finger_give_it_again(tmp_path, units, lines):
    """Description lines are in the file's coordinates and hold its unit where it was given."""
    path = write_dxf(tmp_path / "beam.dxf", [[(x / 25, y / 25) for x, y in BEAM]], units=units)
    finger = finger_from_file(path, load_description(None, lines))
    (tmp_path / "beam.toml").write_text(description_lines(finger))
    again = finger_from_file(path)
    assert again.section.area == pytest.approx(finger.section.area)
    np.testing.assert_allclose(again.markers, finger.markers, atol=1e-9)
    assert (again.contact_abscissa, again.depth) == pytest.approx((finger.contact_abscissa, finger.depth))
    assert set(again.sources.values()) == {"given"}


def test_mesh_with_groups_is_taken_as_it_is(tmp_path):
    groups = ("base", "contact", "front", "markers")
    finger = finger_from_file(write_beam_mesh(tmp_path / "beam.msh", groups=groups))
    mesh = finger.mesh
    assert mesh is not None
    assert mesh.areas.sum() == pytest.approx(1000)
    lengths = {name: round(mesh.boundary_length(name), 6) for name in mesh.boundaries}
    assert lengths == {"base": 10, "front": 100, "back": 100, "contact": 4}
    assert mesh.markers == pytest.approx(np.array([[50, -5]]))
    assert mesh.points[mesh.contact_node] == pytest.approx([42, 0])
    assert (finger.contact_abscissa, finger.contact_width) == pytest.approx((42, 4))
    unmarked = finger_from_file(write_beam_mesh(tmp_path / "unmarked.msh", groups=("base", "contact")))
    np.testing.assert_array_equal(unmarked.mesh.markers, unmarked.markers)  # proposed, at its nodes
    assert pickle.loads(pickle.dumps(finger)).digest == finger.digest
    assert finger.definition()["mesh"] == mesh.digest
    assert finger.at_contact(30).mesh is None


def test_the_mesh_of_the_file_is_left_when_sizes_are_given_even_the_default_ones(tmp_path):
    finger = finger_from_file(write_beam_mesh(tmp_path / "beam.msh"))
    own, default = finger_mesh(finger), finger_mesh(finger, settings=MeshSettings())
    assert own.digest == finger.mesh.digest
    assert len(default.triangles) > 4 * len(own.triangles)
    assert expected_triangles(finger, None) == len(own.triangles)
    assert expected_triangles(finger, MeshSettings()) == pytest.approx(len(default.triangles), rel=0.15)


@pytest.mark.parametrize("path", FILES, ids=IDS)
def test_definition_is_read_back(path):
    finger = finger_in(path)
    again = DrawnFinger.from_definition(json.loads(json.dumps(finger.definition())))
    assert again.definition() == finger.definition()
    assert again.digest == finger.digest
    assert again.facts() == finger.facts()
    assert finger.plot().axes


@pytest.mark.parametrize("path", [FILES[0], CSIRO], ids=["Finray_8", "csiro"])
def test_drawn_fingers_are_meshed(path):
    finger = finger_in(path)
    mesh = build_mesh(finger, MeshSettings(size=1.5, coarsening=2))
    assert mesh.areas.sum() == pytest.approx(finger.section.area, rel=1e-3)
    assert mesh.boundary_length("base") == pytest.approx(clamped_length(finger), rel=1e-6)
    np.testing.assert_allclose(mesh.markers, finger.markers, atol=1e-9)


def test_a_drawing_of_which_all_is_called_front_is_read(tmp_path):
    """What is named may lie on the boundary, but here it is the boundary."""
    path = write_svg(tmp_path / "a.svg", '<g id="front"><rect width="60" height="9"/></g>')
    finger = finger_from_file(path, Description(clamp=[[0, 0], [0, -9]], contact=[40, 0]))
    assert np.ptp(finger.section.outline.points, axis=0) == pytest.approx([60, 9])

"""The fiducials around the finger: default places, limits, the file and the sheet."""

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pinnray.geometry.finger.design import Design
from pinnray.geometry.section.loop import Loop
from pinnray.geometry.section.section import Section
from pinnray.runtime.errors import UserError
from pinnray.vision.tracking.workspace import Workspace, default_workspace, load_workspace, workspace_svg
from tests.fingers import beam

SQUARE = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
SVG = "{http://www.w3.org/2000/svg}"


@pytest.mark.parametrize("turn", [np.diag([-1, -1]), np.diag([-1, 1]), np.diag([1, -1])])
def test_the_default_layout_is_no_turned_or_mirrored_copy_of_itself(turn):
    points = default_workspace(Design()).points
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    turned = (points - middle) @ turn + middle
    missed = np.linalg.norm(turned[:, None] - points, axis=2).min(axis=1)
    assert missed.max() > 4


@pytest.mark.parametrize(
    ("position", "places"),
    [
        (70.0, (15.0, 80.0)),  # right above the fiducial at 70 %: to the right
        (75.0, (15.0, 65.0)),  # beside it: away from the contact
        (64.0, (15.0, 74.0)),
        (20.0, (10.0, 70.0)),
        (11.0, (21.0, 70.0)),
        (45.0, (15.0, 70.0)),  # far from both
    ],
)
def test_the_default_fiducials_stand_around_the_finger_beside_the_indenter(position, places):
    """12 mm around it; half of the contact's 4 mm and 8 % of the length are left free on either side."""
    points = default_workspace(replace(beam(), contact_abscissa=position)).points
    front = [(x, 12.0) for x in (-12.0, *places, 112.0)]
    np.testing.assert_allclose(points, [*front, (-12, -22), (45, -22), (112, -22)], rtol=1e-12)


def test_the_default_fiducials_move_with_the_finger() -> None:
    corners = [(30, -10), (130, -10), (130, 0), (30, 0)]
    section = Section(Loop.polygon(corners, ("back", "tip", "front", "base")))
    shifted = replace(beam(), section=section, markers=beam().markers + np.array([30.0, 0.0]))
    points = default_workspace(replace(shifted, contact_abscissa=100.0)).points
    np.testing.assert_allclose(points, default_workspace(beam()).points + np.array([30.0, 0.0]), rtol=1e-12)


def test_fiducials_lie_on_a_line_if_they_spread_a_twentieth_as_far_across_it() -> None:
    """A rhombus about (300, 200), turned by 30 degrees."""
    turn = np.array([[np.sqrt(0.75), -0.5], [0.5, np.sqrt(0.75)]])
    narrow, wide = (
        tuple(map(tuple, (50 * np.array([[1, 0], [-1, 0], [0, least], [0, -least]]) @ turn + (300, 200))))
        for least in (0.049, 0.051)
    )
    assert len(Workspace(fiducials=wide).points) == 4
    with pytest.raises(UserError, match="on a line"):
        Workspace(fiducials=narrow)


def test_a_file_has_the_fields_and_limits_are_in_range(tmp_path: Path) -> None:
    path = tmp_path / "workspace.json"
    for height, diameter in ((-1000.0, 1000.0), (1000.0, 0.1)):
        written = Workspace(fiducials=SQUARE, fiducial_diameter=diameter, marker_plane=height, simulated=True)
        path.write_text(written.model_dump_json())
        assert load_workspace(path) == written


def test_the_sheet_is_in_true_scale_with_white_space_around_the_discs_and_a_ruler_below() -> None:
    """Discs of radius 3 and 10 mm beyond them: from -25 to 125 and from -35 to 25."""
    corners = ((-12.0, 12.0), (112.0, 12.0), (112.0, -22.0), (-12.0, -22.0))
    root = ET.fromstring(workspace_svg(Workspace(fiducials=corners, fiducial_diameter=6.0), beam()))
    assert root.attrib["viewBox"] == "-25 -25 150 60"
    assert (root.attrib["width"], root.attrib["height"]) == ("150mm", "60mm")
    discs = root.findall(f".//{SVG}circle")
    assert {disc.attrib["r"] for disc in discs} == {"3"}
    assert [(float(disc.attrib["cx"]), float(disc.attrib["cy"])) for disc in discs] == list(corners)
    (ruler,), (words,) = root.findall(f".//{SVG}line"), root.findall(f".//{SVG}text")
    assert [float(ruler.attrib[end]) for end in ("x1", "x2")] == [25, 75]
    (height,) = {float(ruler.attrib[end]) for end in ("y1", "y2")}
    assert -35 < height < -22 - 3 - 5, "between the discs and the edge"
    assert -float(words.attrib["y"]) == height + 1, "1 mm above it"
    (polygon,) = root.findall(f".//{SVG}polygon")
    points = [tuple(map(float, point.split(","))) for point in polygon.attrib["points"].split()]
    assert set(points) == {(0, -10), (100, -10), (100, 0), (0, 0)}

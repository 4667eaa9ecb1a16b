"""Limits of a workspace's layout, the default one, and the sheet, on a beam of 100 by 10 mm."""

import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geometry.errors import UserError
from geometry.section.loop import Loop
from geometry.section.section import Section
from tests.fingers import beam
from vision.tracking.workspace import Workspace, default_workspace, load_workspace, workspace_svg

SQUARE = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
SVG = "{http://www.w3.org/2000/svg}"


def test_what_is_not_given_is_as_documented() -> None:
    """Discs of 4 mm in the markers' plane, of a real rig."""
    workspace = Workspace(fiducials=SQUARE)
    assert workspace.model_dump() == {
        **{"fiducials": SQUARE, "fiducial_diameter": 4.0},
        **{"marker_plane": 0.0, "simulated": False},
    }
    assert workspace.points.tolist() == [list(point) for point in SQUARE]


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
    section = Section(
        Loop.polygon([(30, -10), (130, -10), (130, 0), (30, 0)], ("back", "tip", "front", "base"))
    )
    shifted = replace(beam(), section=section, markers=beam().markers + np.array([30.0, 0.0]))
    points = default_workspace(replace(shifted, contact_abscissa=100.0)).points
    np.testing.assert_allclose(points, default_workspace(beam()).points + np.array([30.0, 0.0]), rtol=1e-12)


@pytest.mark.parametrize("least", [0.049, 0.051])
def test_fiducials_lie_on_a_line_if_they_spread_a_twentieth_as_far_across_it(least: float) -> None:
    """A rhombus about (300, 200), turned by 30 degrees."""
    turn = np.array([[np.sqrt(0.75), -0.5], [0.5, np.sqrt(0.75)]])
    rhombus = 50 * np.array([[1, 0], [-1, 0], [0, least], [0, -least]]) @ turn + (300, 200)
    fiducials = tuple(map(tuple, rhombus.tolist()))
    if least < 0.05:
        with pytest.raises(UserError, match="workspace: the fiducials lie on a line"):
            Workspace(fiducials=fiducials)
    else:
        assert len(Workspace(fiducials=fiducials).points) == 4


@pytest.mark.parametrize("count", [3, 4])
def test_four_fiducials_are_needed(count: int) -> None:
    if count == 4:
        assert len(Workspace(fiducials=SQUARE).fiducials) == 4
        return
    with pytest.raises(UserError, match="workspace: 3 fiducials; at least 4 are needed"):
        Workspace(fiducials=SQUARE[:3])


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"fiducial_diameter": 0.0}, "workspace: fiducial_diameter: .* greater than 0"),
        ({"fiducial_diameter": 1000.1}, "workspace: fiducial_diameter: .* less than or equal to 1000"),
        ({"marker_plane": 1000.1}, "workspace: marker_plane: .* less than or equal to 1000"),
        ({"marker_plane": -1000.1}, "workspace: marker_plane: .* greater than or equal to -1000"),
        ({"marker_plane": float("inf")}, "workspace: marker_plane: .* finite"),
        ({"colour": 1}, "workspace: colour: "),
    ],
)
def test_what_no_table_has_is_refused(values: dict[str, Any], said: str) -> None:
    with pytest.raises(UserError, match=said):
        Workspace(fiducials=SQUARE, **values)


def test_limits_are_in_range() -> None:
    for height in (-1000.0, 1000.0):
        assert (
            Workspace(fiducials=SQUARE, fiducial_diameter=1000.0, marker_plane=height).marker_plane == height
        )
    assert Workspace(fiducials=SQUARE, fiducial_diameter=0.1).fiducial_diameter == 0.1


def test_a_workspace_does_not_change() -> None:
    with pytest.raises(ValueError, match="frozen"):
        Workspace(fiducials=SQUARE).fiducial_diameter = 5.0


def test_a_file_has_the_fields_and_errors_name_it(tmp_path: Path) -> None:
    path = tmp_path / "workspace.json"
    written = Workspace(fiducials=SQUARE, fiducial_diameter=3.0, marker_plane=2.0, simulated=True)
    path.write_text(written.model_dump_json())
    assert load_workspace(path) == written
    path.write_text(json.dumps([1, 2]))
    with pytest.raises(UserError, match=f"{path}: a workspace has fiducials, fiducial_diameter"):
        load_workspace(path)
    path.write_text(json.dumps({"fiducials": SQUARE[:3]}))
    with pytest.raises(UserError, match=f"{path}: workspace: 3 fiducials"):
        load_workspace(path)


def test_the_sheet_has_white_space_around_the_discs_and_a_ruler_below() -> None:
    """Discs of radius 3 and 10 mm beyond them: from -25 to 125 and from -35 to 25."""
    corners = ((-12.0, 12.0), (112.0, 12.0), (112.0, -22.0), (-12.0, -22.0))
    root = ET.fromstring(workspace_svg(Workspace(fiducials=corners, fiducial_diameter=6.0), beam()))
    assert root.attrib["viewBox"] == "-25 -25 150 60"
    assert (root.attrib["width"], root.attrib["height"]) == ("150mm", "60mm")
    assert {disc.attrib["r"] for disc in root.findall(f".//{SVG}circle")} == {"3"}
    ruler, words = root.find(f".//{SVG}line"), root.find(f".//{SVG}text")
    assert ruler is not None
    assert words is not None
    assert [float(ruler.attrib[end]) for end in ("x1", "x2")] == [25, 75]
    (height,) = {float(ruler.attrib[end]) for end in ("y1", "y2")}
    assert -35 < height < -22 - 3 - 5, "between the discs and the edge"
    assert float(words.attrib["x"]) == 50
    assert -float(words.attrib["y"]) == height + 1, "1 mm above it"
    polygon = root.find(f".//{SVG}polygon")
    assert polygon is not None
    points = [tuple(map(float, point.split(","))) for point in polygon.attrib["points"].split()]
    assert set(points) == {(0, -10), (100, -10), (100, 0), (0, 0)}

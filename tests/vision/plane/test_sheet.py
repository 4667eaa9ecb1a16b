"""The sheet of fiducials is in true scale."""

import xml.etree.ElementTree as ET

import numpy as np

from geometry.finger.design import Design
from vision.tracking.workspace import default_workspace, workspace_svg

SVG = "{http://www.w3.org/2000/svg}"


def test_the_sheet_shows_the_fiducials_in_true_scale():
    workspace = default_workspace(Design())
    root = ET.fromstring(workspace_svg(workspace, Design()).encode())
    left, top, width, height = map(float, root.attrib["viewBox"].split())
    assert (root.attrib["width"], root.attrib["height"]) == (f"{width:g}mm", f"{height:g}mm")
    discs = root.findall(f".//{SVG}circle")
    centres = np.array([[float(disc.attrib["cx"]), float(disc.attrib["cy"])] for disc in discs])
    np.testing.assert_allclose(centres, workspace.points, rtol=1e-12)
    assert {float(disc.attrib["r"]) for disc in discs} == {2.0}
    on_paper = centres * (1, -1) - (left, top)  # the group is mirrored
    assert (on_paper > 10).all()
    assert (on_paper < (width - 10, height - 10)).all()
    (ruler,) = root.findall(f".//{SVG}line")
    assert float(ruler.attrib["x2"]) - float(ruler.attrib["x1"]) == 50
    corners = root.find(f".//{SVG}polygon").attrib["points"].split()
    assert "0.000000,-30.000000" in corners

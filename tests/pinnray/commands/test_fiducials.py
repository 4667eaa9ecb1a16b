"""The sheets to print, without a film."""

import re
import xml.etree.ElementTree as ET

import cv2
import numpy as np
import pytest

from pinnray.cli import main
from pinnray.vision.calibration.charuco import parse_board
from pinnray.vision.tracking.workspace import default_workspace, load_workspace

PIXELS_PER_MM = 4
SVG = "{http://www.w3.org/2000/svg}"


def printed(path) -> tuple[np.ndarray, np.ndarray]:
    """A board's SVG as pixels, and the place of its origin in them."""
    root = ET.parse(path).getroot()
    left, top, width, height = map(float, root.attrib["viewBox"].split())
    assert (root.attrib["width"], root.attrib["height"]) == (f"{width:g}mm", f"{height:g}mm")  # true scale
    image = np.full((round(height * PIXELS_PER_MM), round(width * PIXELS_PER_MM)), 255, dtype=np.uint8)
    for polygon in root.find(f"{SVG}path").attrib["d"].split("Z"):
        if numbers := re.findall(r"-?[\d.]+", polygon):
            corners = np.array(numbers, dtype=float).reshape(-1, 2) - (left, top)
            # Pixels' centres are whole numbers; OpenCV fills polygons with their border.
            low, high = np.ceil(corners.min(0) * PIXELS_PER_MM - 0.5), corners.max(0) * PIXELS_PER_MM - 0.5
            (x0, y0), (x1, y1) = low.astype(int), np.ceil(high).astype(int)
            image[y0:y1, x0:x1] = 0
    return image, -np.array([left, top]) * PIXELS_PER_MM - 0.5


@pytest.mark.parametrize(
    ("options", "board"),
    [
        ("--square 20", parse_board("9x6", 20.0)),
        ("--board charuco:8x6 --square 25 --marker 18", parse_board("charuco:8x6", 25.0, marker=18.0)),
    ],
)
def test_the_printed_board_is_found_in_true_scale_and_not_mirrored(options, board, tmp_path):
    assert main(["fiducials", *options.split(), "--out", str(tmp_path)]) == 0
    image, origin = printed(tmp_path / "board.svg")
    image = cv2.copyMakeBorder(image, 60, 60, 60, 60, cv2.BORDER_CONSTANT, value=120)
    found = board.find(cv2.GaussianBlur(image, (0, 0), 1.0))  # as a lens does
    assert found is not None
    expected = board.corners[:, :2] * PIXELS_PER_MM + origin + 60
    if "charuco" not in options and np.abs(found - expected).max() > 10:
        found = found[::-1]  # a chessboard looks the same when it is turned by half
    assert np.abs(found - expected).max() < 0.1  # pixels, of 0.25 mm


def test_the_fiducials_are_those_of_the_design_at_the_height_of_its_markers(tmp_path, capsys):
    from pinnray.geometry.finger.presets import load_design

    design = load_design("slender")
    options = ["--design", "slender", "--marker-plane", "20", "--out", str(tmp_path)]
    assert main(["fiducials", *options]) == 0
    files = [tmp_path / name for name in ("fiducials.svg", "fiducials.json", "board.svg")]
    assert capsys.readouterr().out.split() == [str(file) for file in files]
    assert load_workspace(files[1]) == default_workspace(design).model_copy(update={"marker_plane": 20.0})
    discs = ET.parse(files[0]).getroot().findall(f".//{SVG}circle")
    centres = [(float(disc.attrib["cx"]), float(disc.attrib["cy"])) for disc in discs]
    np.testing.assert_allclose(centres, default_workspace(design).points, atol=1e-3)

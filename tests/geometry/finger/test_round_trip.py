"""Exports of `pinnray design` are read back as the same finger."""

from pathlib import Path

import numpy as np
import pytest

from pinnray.cli import main
from pinnray.geometry import Design, load_design
from pinnray.geometry.drawing.load import finger_from_file

FINGERS = {
    "default": [],
    "fillets and a round tip": ["--set", "fillet_radius=1", "--set", "tip_radius=1.5"],
    "csiro": ["--design", "csiro"],
    "contact aside": ["--set", "contact_position=60", "--set", "marker_layout=front"],
}


def design_of(options: list[str]) -> Design:
    changes = dict(text.split("=") for text in options[1::2] if "=" in text)
    return load_design("csiro" if "csiro" in options else "default", changes)


@pytest.mark.slow
@pytest.mark.parametrize("options", FINGERS.values(), ids=FINGERS)
def test_every_export_is_read_back_as_the_same_finger(options: list[str], tmp_path: Path) -> None:
    design = design_of(options)
    assert main(["design", *options, "--formats", "step,dxf", "--out", str(tmp_path)]) == 0
    for name in ("finger.step", "section.dxf"):
        drawn = finger_from_file(tmp_path / name)
        shift = drawn.placement.shift  # of csiro: x = 0 is at the foot, which the design has at negative x
        assert options or str(drawn.placement) == "turned by 0 degrees, shifted by (0, 0) mm"
        np.testing.assert_allclose(drawn.placement.matrix, np.eye(2), atol=1e-12)
        assert drawn.section.area == pytest.approx(design.section.area, rel=1e-9)
        assert len(drawn.section.cavities) == len(design.section.cavities)
        if name == "finger.step":
            assert drawn.depth == pytest.approx(design.depth, rel=1e-9)
            assert drawn.marker_height == pytest.approx(design.marker_height, rel=1e-6)
        else:  # its layers name clamp and contact
            assert (drawn.sources["clamp"], drawn.sources["contact"]) == ("drawn", "drawn")
        np.testing.assert_allclose(drawn.markers - shift, design.markers, atol=1e-9)
        assert drawn.contact_abscissa - shift[0] == pytest.approx(design.contact_abscissa, abs=1e-9)
        assert drawn.contact_width == pytest.approx(design.contact_width, abs=1e-9)
        assert drawn.marker_diameter == pytest.approx(design.marker_diameter, abs=1e-9)
        clamped, expected = (
            sum(loop.lengths[which] for loop, which in section.named("base"))
            for section in (drawn.section, design.section)
        )
        assert clamped == pytest.approx(expected, rel=1e-9)

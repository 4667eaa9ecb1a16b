import numpy as np
import pytest

from pinnray.comparison.figures.design_drawing import draw_design
from pinnray.geometry.drawing.drawn_finger import DrawnFinger
from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.presets import load_design, preset_names
from tests.compare.figures.drawn_pages import page_of
from tests.fingers import beam, ring

DESIGNS = {
    **{name: load_design(name) for name in preset_names()},
    "front markers": Design(marker_layout="front", rib_angle=-15, fillet_radius=1.2),
    "without ribs": Design(rib_count=0),
    "one rib": Design(rib_count=1, rib_angle=0, tip_length=40),
    "csiro, joints": load_design("csiro", {"marker_layout": "joints"}),
}


@pytest.mark.slow
@pytest.mark.parametrize("design", DESIGNS.values(), ids=DESIGNS)
def test_a_drawing_has_every_dimension_and_none_overlaps(design: Design) -> None:
    page = page_of(draw_design(design))
    expected = [
        *(f"= {getattr(design, name):.4g} mm" for name in ("height", "base_width", "depth", "tip_length")),
        *(f"= {getattr(design, name):.4g} mm" for name in ("front_thickness", "back_thickness")),
        *(f"= {design.rib_count} ribs", "x, u", "y, v"),
    ]
    if design.rib_count:
        expected += [f"= {design.rib_thickness:.4g} mm", r"$L_\mathrm{angle}$"]
    assert [dimension for dimension in expected if dimension not in page.text] == []
    assert page.cut_off() == []
    assert page.overlaps() == []


@pytest.mark.parametrize("finger", [ring(), ring(24), beam()], ids=["ring", "many markers", "beam"])
def test_a_finger_without_parameters_has_its_overall_dimensions(finger: DrawnFinger) -> None:
    page = page_of(draw_design(finger))
    width, height = np.ptp(finger.section.bounds, axis=0)
    expected = [f"{width:.4g} mm", f"{height:.4g} mm", "depth 20 mm", "clamped", str(len(finger.markers))]
    assert [text for text in expected if text not in page.text] == []
    assert page.cut_off() == []
    assert page.overlaps() == []


def test_numbers_of_markers_at_joints_lie_neither_on_the_outline_nor_on_another_marker() -> None:
    for finger in (load_design("default", {"marker_layout": "joints"}), ring()):
        (axes,) = draw_design(finger).axes
        numbers = [text for text in axes.texts if text.get_text() in {str(n) for n in range(1, 10)}]
        assert len(numbers) == 9
        places = np.array([text.get_position() for text in numbers])
        em = np.ptp(axes.get_xlim()) * 6.5 / 72 / 5.5
        for place in places:
            assert np.linalg.norm(finger.markers - place, axis=1).min() > finger.marker_radius + 0.3 * em
            assert abs(finger.section.clearance(place)[0]) > 0.2 * em


def test_the_clamp_is_hatched_along_every_piece_of_the_base_on_its_outer_side() -> None:
    for finger in (load_design("csiro"), ring()):
        (axes,) = draw_design(finger).axes
        strokes = np.concatenate([lines.get_segments() for lines in axes.collections])  # type: ignore[attr-defined]
        assert finger.section.clearance(strokes[:, 0]).min() > -1e-3  # they start on the outline
        assert finger.section.clearance(strokes[:, 1]).max() < 0
        for loop, which in finger.section.named("base"):
            near = np.linalg.norm(strokes[:, 0] - loop.along(which, 0.5)[0], axis=1).min()
            assert near < 0.06 * np.ptp(finger.section.bounds)

import pytest

from compare.figures.design_drawing import draw_design
from geometry.finger.design import Design
from geometry.finger.parameters import Parameters
from geometry.finger.presets import load_design, preset_names
from tests.compare.drawn_pages import page_of

DESIGNS = {
    **{name: load_design(name) for name in preset_names()},
    "front markers": Design(marker_layout="front", rib_angle=-15, fillet_radius=1.2),
    "without ribs": Design(rib_count=0),
    "one rib": Design(rib_count=1, rib_angle=0, tip_length=40),
}


@pytest.mark.parametrize("design", DESIGNS.values(), ids=DESIGNS)
def test_a_drawing_has_every_dimension_and_none_overlaps(design: Parameters) -> None:
    page = page_of(draw_design(design))
    expected = [
        rf"$H$ = {design.height:g} mm",
        rf"$L$ = {design.base_width:g} mm",
        rf"$W$ = {design.depth:g} mm",
        rf"$L_\mathrm{{tip}}$ = {design.tip_length:g} mm",
        rf"$t_\mathrm{{flex}}$ = {design.front_thickness:g} mm",
        rf"$t_\mathrm{{back}}$ = {design.back_thickness:g} mm",
        rf"$N$ = {design.rib_count} ribs",
    ]
    if design.rib_count:
        expected += [rf"$t_\mathrm{{rib}}$ = {design.rib_thickness:g} mm", r"$L_\mathrm{angle}$"]
    assert [dimension for dimension in expected if dimension not in page.text] == []
    numerals = {str(number) for number in range(1, 100)}
    assert page.cut_off() == []
    assert [pair for pair in page.overlaps() if not numerals & set(pair)] == []

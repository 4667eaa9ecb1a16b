"""SVG files as programs write them: what is drawn, copies, and sizes."""

import numpy as np
import pytest

from pinnray.geometry.drawing.checks import body
from pinnray.geometry.drawing.description import Description
from pinnray.geometry.drawing.load import finger_from_file, read_drawing
from tests.geometry.drawing.files import write_svg

BODY = '<rect width="60" height="10"/>'
HOLE = '<rect id="hole" x="20" y="3" width="10" height="4"/>'


def area(path, **settings: object) -> float:
    return body(read_drawing(path, **settings).loops).area


@pytest.mark.parametrize(
    "undrawn",
    [
        *(
            f'<{tag} id="a">{HOLE}</{tag}>'
            for tag in ("mask", "symbol", "marker", "clipPath", "pattern", "defs")
        ),
        f'<mask id="a"><g><g>{HOLE}</g></g></mask>',
        f'<g clip-path="url(#a)"><symbol id="b">{HOLE}</symbol></g>',
        f"<foreignObject>{HOLE}</foreignObject>",
        f"<metadata>{HOLE}</metadata>",
        f'<x:page xmlns:x="http://example.org/x">{HOLE}</x:page>',
        f'<g style="display:none">{HOLE}</g>',
        f'<g style="visibility:collapse">{HOLE}</g>',
        f'<style>.off {{display: none}}</style><g class="off">{HOLE}</g>',
        f"<switch><g/>{HOLE}</switch>",
        f'<switch><foreignObject requiredExtensions="a"/><g/>{HOLE}</switch>',
        '<path id="path7" style="fill:none"/><path d=""/><path d="  "/><path d="none"/>',
        '<rect width="0" height="5"/><circle r="0"/><polygon points=""/>',
    ],
)
def test_what_svg_does_not_draw_is_left_out(tmp_path, undrawn):
    assert area(write_svg(tmp_path / "a.svg", BODY + undrawn)) == pytest.approx(600)


def test_a_copy_is_copied_again(tmp_path):
    copies = '<g id="s"><rect x="2" y="2" width="3" height="3"/></g>'
    copies += '<g id="t"><use href="#s" x="10"/></g><use href="#t" y="1"/>'
    _, *holes = read_drawing(write_svg(tmp_path / "a.svg", f"{BODY}{copies}")).loops
    found = sorted(hole.bounds.round(9).tolist() for hole in holes)
    assert found == [[[2, -5], [5, -2]], [[12, -6], [15, -3]], [[12, -5], [15, -2]]]


def test_a_copy_has_its_name(tmp_path):
    path = write_svg(
        tmp_path / "a.svg",
        f'{BODY}<defs><circle id="dot" r="0.8"/></defs>'
        '<g id="markers"><use href="#dot" x="20" y="5"/></g>'
        '<use id="markers" href="#dot" x="40" y="5"/>',
    )
    assert read_drawing(path).markers == pytest.approx(np.array([[20, -5], [40, -5]]))


@pytest.mark.parametrize(
    ("head", "unit", "said"),
    [
        ('viewBox="0 0 226.77 113.39"', 25.4 / 96, True),
        ('width="80" height="40"', 25.4 / 96, True),
        ('width="160px" height="80px" viewBox="0 0 80 40"', 25.4 / 48, True),
        ("", 25.4 / 96, True),
        ('width="80mm"', 25.4 / 96, True),  # without a viewBox a unit is a pixel, whatever the page
        ('width="80mm" height="40mm" viewBox="0 0 80 40"', 1.0, False),
        ('width="8cm" height="4cm" viewBox="0 0 80 40"', 1.0, False),
        ('width="72pt" height="36pt" viewBox="0 0 72 36"', 25.4 / 72, False),
        ('width="6pc" height="3pc" viewBox="0 0 72 36"', 25.4 / 72, False),
    ],
)
def test_a_size_that_is_a_guess_says_so(tmp_path, head, unit, said):
    path = write_svg(tmp_path / "a.svg", '<rect width="60" height="40"/>', head)
    drawing = read_drawing(path)
    assert body(drawing.loops).area == pytest.approx(2400 * unit**2)
    assert ("(assumed: 96 pixels to an inch" in drawing.note) == said
    assert area(path, units="pt") == pytest.approx(2400 * (25.4 / 72) ** 2)


def test_markers_of_curves_are_circles(tmp_path):
    """Illustrator writes a circle as four curves."""
    k, r = 0.5522847498 * 0.8, 0.8
    curve = f"c0 {k} {k - r} {r} {-r} {r}s{-r} {k - r} {-r} {-r}s{r - k} {-r} {r} {-r}s{r} {r - k} {r} {r}z"
    path = write_svg(tmp_path / "a.svg", f'{BODY}<g id="markers"><path d="M20.8 5{curve}"/></g>')
    drawing = read_drawing(path)
    assert drawing.markers == pytest.approx(np.array([[20, -5]]), abs=1e-3)
    assert drawing.marker_diameter == pytest.approx(1.6, rel=1e-3)


def test_markers_of_different_sizes_count_as_the_least(tmp_path):
    """Small ones in thin walls and larger ones in the tip."""
    discs = "".join(
        f'<circle cx="{x}" cy="{y}" r="{r}"/>' for x, y, r in ((9, 1, 0.4), (30, 4, 2), (50, 5, 1))
    )
    path = write_svg(tmp_path / "a.svg", f'{BODY}<g id="markers">{discs}</g>')
    drawing = read_drawing(path)
    assert drawing.marker_diameter == pytest.approx(0.8)
    assert ", markers of 0.8 to 4 mm taken as of 0.8 mm" in drawing.note
    finger = finger_from_file(path, Description(clamp=[[0, 0], [0, -10]], contact=[50, 0]))
    assert len(finger.markers) == 3
    assert finger.sources["marker_diameter"] == "drawn"

"""DXF files as programs write them: units, blocks, what does not show, and damage."""

import subprocess
import sys
from pathlib import Path

import ezdxf
import numpy as np
import pytest
from ezdxf.document import Drawing as Document

from pinnray.geometry import UserError
from pinnray.geometry.drawing.checks import body
from pinnray.geometry.drawing.formats.drawing import UNITS
from pinnray.geometry.drawing.formats.dxf import HEADER_UNITS
from pinnray.geometry.drawing.load import read_drawing
from tests.geometry.drawing.files import BEAM, broken_dxf, rectangle, write_dxf

HOLE = rectangle(20, -7, 10, 4)
HEADER = "0\nSECTION\n2\nHEADER\n"


def document_with(path: Path, units: int = 4) -> tuple[Document, Path]:
    """A document with the beam, to be saved at the path."""
    document = ezdxf.new(units=units)
    document.modelspace().add_lwpolyline(BEAM, close=True)
    return document, path / "a.dxf"


def area(path: Path, **settings: object) -> float:
    return body(read_drawing(path, **settings).loops).area


def refusal(path: Path, **settings: object) -> str:
    with pytest.raises(UserError) as error:
        read_drawing(path, **settings)
    assert "\n" not in str(error.value)
    return str(error.value)


def lines_text(order: tuple[int, ...] = (10, 20, 11, 21), head: str = "") -> str:
    """The beam as lines of the format's twelfth release, with the group codes in an order."""
    text = f"{head}0\nSECTION\n2\nENTITIES\n"
    for (x, y), (z, w) in zip(BEAM, BEAM[1:] + BEAM[:1], strict=True):
        values = {10: x, 20: y, 11: z, 21: w}
        text += "0\nLINE\n8\n0\n" + "".join(f"{code}\n{values[code]}\n" for code in order)
    return text + "0\nENDSEC\n0\nEOF\n"


@pytest.mark.parametrize("number", range(1, 25))
def test_a_unit_of_the_header_is_converted_or_refused_by_its_name(tmp_path, number):
    length = UNITS[HEADER_UNITS.get(number, "mm")]
    small = [(60 / length * x / 100, 60 / length * y / 100) for x, y in BEAM]  # 60 mm long
    path = write_dxf(tmp_path / "a.dxf", [small], units=number)
    if number not in HEADER_UNITS:
        assert f"($INSUNITS) is {number}, " in refusal(path)
        assert area(path, units="mm") == pytest.approx(360)
        return
    drawing = read_drawing(path)
    assert body(drawing.loops).area == pytest.approx(360, rel=1e-9)
    assert f"DXF, {HEADER_UNITS[number]} (of the header)" in drawing.note
    path = write_dxf(tmp_path / "mm.dxf", [BEAM], units=number)
    if number == 4:
        assert area(path) == pytest.approx(1000)
    else:  # plainly in mm
        assert 'units = "mm" makes it 100 mm' in refusal(path)
        assert area(path, units="mm") == pytest.approx(1000)


@pytest.mark.parametrize(
    "text",
    [
        # without a unit, mm are assumed
        lines_text(),
        lines_text(head="999\na comment\n"),
        lines_text(head=f"{HEADER}9\n$ACADVER\n1\nAC1009\n0\nENDSEC\n"),
    ],
)
def test_lines_of_the_twelfth_release_are_read(tmp_path, text):
    (tmp_path / "a.dxf").write_text(text, encoding="utf-8")
    drawing = read_drawing(tmp_path / "a.dxf")
    assert drawing.note.startswith("DXF, mm (assumed)")
    assert body(drawing.loops).area == pytest.approx(1000)


def test_what_is_on_layer_0_of_a_block_is_on_the_layer_of_its_insertion(tmp_path):
    document, path = document_with(tmp_path)
    document.blocks.new("dot").add_circle((0, 0), 0.6)
    outer = document.blocks.new("dots")
    outer.add_blockref("dot", (0, 0))  # on 0: twice through
    outer.add_blockref("dot", (10, 0), dxfattribs={"layer": "hole"})
    document.modelspace().add_blockref("dots", (20, -5), dxfattribs={"layer": "Markers"})
    clamp = document.blocks.new("clamp")
    clamp.add_lwpolyline(BEAM[:2])
    document.modelspace().add_blockref("clamp", (0, 0), dxfattribs={"layer": "base"})
    document.saveas(path)
    drawing = read_drawing(path)
    assert drawing.markers.tolist() == [[20, -5]]
    section = body(drawing.loops)
    assert len(section.cavities) == 1
    assert [section.outline.lengths[k] for k in section.outline.pieces("base")] == [10]


@pytest.mark.parametrize(("rows", "columns", "turn"), [(1, 3, 0), (2, 3, 0), (1, 4, 180)])
def test_rows_and_columns_of_an_insertion_count(tmp_path, rows, columns, turn):
    document, path = document_with(tmp_path)
    document.blocks.new("hole").add_circle((0, 0), 1)
    grid = {"row_count": rows, "column_count": columns, "row_spacing": 4, "column_spacing": 9}
    document.modelspace().add_blockref("hole", (50, -7 if turn == 0 else -3), {**grid, "rotation": turn})
    document.saveas(path)
    assert area(path) == pytest.approx(1000 - rows * columns * np.pi, rel=1e-9)


@pytest.mark.parametrize(("hide", "holes"), [("freeze", 0), ("off", 1)])
def test_a_frozen_insertion_hides_all_its_layers_and_one_that_is_off_its_own(tmp_path, hide, holes):
    document, path = document_with(tmp_path)
    getattr(document.layers.add("frame"), hide)()
    hole, sheet = document.blocks.new("hole"), document.blocks.new("sheet")
    hole.add_circle((20, -5), 1, dxfattribs={"layer": "cut"})
    hole.add_circle((40, -5), 1)
    for layer in ("0", "frame"):
        sheet.add_lwpolyline(rectangle(-50, -50, 200, 100), close=True, dxfattribs={"layer": layer})
    document.blocks.new("nested").add_blockref("sheet", (0, 0))
    for name in ("hole", "nested"):
        document.modelspace().add_blockref(name, (0, 0), dxfattribs={"layer": "frame"})
    document.saveas(path)
    assert area(path) == pytest.approx(1000 - holes * np.pi)


@pytest.mark.parametrize("where", ["entity", "insertion", "in the block", "polyline"])
def test_invisible_entities_do_not_count(tmp_path, where):
    document, path = document_with(tmp_path)
    space, off = document.modelspace(), {"invisible": 1}
    block = document.blocks.new("hole")
    block.add_circle((20, -5), 1, dxfattribs=off if where == "in the block" else {})
    if where == "entity":
        space.add_circle((20, -5), 1, dxfattribs=off)
    elif where == "polyline":
        space.add_polyline2d(HOLE, close=True, dxfattribs=off)
    else:
        space.add_blockref("hole", (0, 0), dxfattribs=off if where == "insertion" else {})
    document.saveas(path)
    assert area(path) == pytest.approx(1000)


@pytest.mark.parametrize("kind", ["missing", "knots", "unread", "itself"])
def test_what_cannot_be_read_does_not_matter_where_it_is_hidden(tmp_path, kind):
    document = ezdxf.readfile(broken_dxf(tmp_path / "a.dxf", kind))
    document.layers.add("old").freeze()
    document.modelspace()[-1].dxf.layer = "old"
    document.saveas(tmp_path / "a.dxf")
    assert area(tmp_path / "a.dxf") == pytest.approx(1000)


def test_markers_drawn_of_arcs_are_circles(tmp_path):
    document, path = document_with(tmp_path)
    space, on = document.modelspace(), {"layer": "markers"}
    space.add_arc((20, -5), 0.8, 0, 180, dxfattribs=on)
    space.add_arc((20, -5), 0.8, 180, 360, dxfattribs=on)
    space.add_lwpolyline([(39.2, -5, 0, 0, 1), (40.8, -5, 0, 0, 1)], close=True, dxfattribs=on)
    space.add_lwpolyline(
        [(60 + 0.8 * np.cos(t), -5 + 0.8 * np.sin(t)) for t in np.linspace(0, 2 * np.pi, 65)[:-1]],
        close=True,
        dxfattribs=on,
    )
    document.saveas(path)
    drawing = read_drawing(path)
    assert drawing.markers == pytest.approx(np.array([[20, -5], [40, -5], [60, -5]]))
    assert drawing.marker_diameter == pytest.approx(1.6, rel=1e-3)
    space.add_lwpolyline(rectangle(80, -5, 1, 1), close=True, dxfattribs=on)
    document.saveas(path)
    assert "is no circle; draw circles or points" in refusal(path)


def test_ezdxf_is_silent(tmp_path):
    """Its notes about a unit that it does not know went to the standard error."""
    write_dxf(tmp_path / "a.dxf", [BEAM])
    code = "import logging, pathlib\nfrom pinnray.geometry.drawing.formats.dxf import read_dxf\n"
    code += (
        f"read_dxf(pathlib.Path({str(tmp_path / 'a.dxf')!r})); logging.getLogger('ezdxf').warning('a note')"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stderr == ""

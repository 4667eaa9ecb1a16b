"""Every reader against areas that come from elsewhere."""

from contextlib import suppress
from pathlib import Path

import cadquery as cq
import ezdxf
import numpy as np
import pytest

from pinnray.geometry import Design, UserError
from pinnray.geometry.cad import write_step as export_step
from pinnray.geometry.drawing.checks import body
from pinnray.geometry.drawing.formats.drawing import Drawing
from pinnray.geometry.drawing.load import read_drawing
from tests.geometry.drawing.files import CSIRO, FINRAY, write_beam_mesh, write_svg


def area(drawing: Drawing) -> float:
    return body(drawing.loops).area


@pytest.mark.parametrize("name", [path.name for path in sorted(FINRAY.glob("*.stp"))])
def test_step_section_has_the_area_of_the_cap(name):
    drawing = read_drawing(FINRAY / name)
    solid = cq.importers.importStep(str(FINRAY / name)).solids().val()
    assert drawing.depth == pytest.approx(12, abs=1e-9)
    assert area(drawing) == pytest.approx(solid.Volume() / 12, rel=1e-9)
    assert read_drawing(FINRAY / name, plane="z = 5").depth == pytest.approx(12, abs=1e-9)
    assert area(read_drawing(FINRAY / name, plane="z = 5")) == pytest.approx(solid.Volume() / 12, rel=1e-9)


@pytest.mark.parametrize(
    ("axis", "angle"),
    [((1, 0, 0), 90), ((0, 1, 0), 90), ((1, 2, 3), 33)],  # along y, along x, along no axis
)
def test_a_turned_solid_has_the_same_section(tmp_path, axis, angle):
    solid = cq.importers.importStep(str(FINRAY / "Finray_8.stp")).solids().val()
    path = tmp_path / "turned.step"
    cq.exporters.export(cq.Workplane(solid.rotate((0, 0, 0), axis, angle).translate((5, 6, 7))), str(path))
    drawing = read_drawing(path)
    assert drawing.depth == pytest.approx(12, abs=1e-6)
    assert area(drawing) == pytest.approx(solid.Volume() / 12, rel=1e-8)


def test_a_solid_that_is_not_extruded_is_cut(tmp_path):
    path = tmp_path / "cone.step"
    cq.exporters.export(cq.Workplane(cq.Solid.makeCone(10, 5, 20)), str(path))
    drawing = read_drawing(path, plane="z = 4", depth_known=True)
    assert drawing.depth == pytest.approx(20)  # across the plane
    assert area(drawing) == pytest.approx(np.pi * 81, rel=1e-9)


@pytest.mark.parametrize("height", [15, 19.8])
def test_deep_markers_leave_no_holes(tmp_path, height):
    """Inlays through more than half of the depth, and through almost all of it."""
    design = Design(marker_height=height)
    drawing = read_drawing(export_step(design, tmp_path)[0])
    assert area(drawing) == pytest.approx(design.section.area, rel=1e-9)
    assert len(drawing.loops) == len(design.section.loops)
    assert drawing.marker_height == pytest.approx(height)


def test_mesh_of_an_extruded_body_gives_its_section():
    drawing = read_drawing(CSIRO)
    section = body(drawing.loops)
    assert drawing.depth == pytest.approx(20.0, abs=1e-6)
    assert section.area == pytest.approx(680.5, abs=0.1)  # measured by others
    assert section.area * 20 == pytest.approx(mesh_volume(CSIRO), rel=1e-3)
    assert len(section.cavities) == 5  # four ribs
    assert all(len(cavity.points) == 4 for cavity in section.cavities)


def mesh_volume(path: Path) -> float:
    """Sum over the tetrahedra, read without Gmsh."""
    lines = path.read_text().split("\n")
    start = lines.index("$Nodes") + 3
    count = int(lines[start - 1].split()[3])
    points = np.array([line.split() for line in lines[start + count : start + 2 * count]], dtype=float)
    cells = np.array([line.split() for line in lines[lines.index("$Elements") + 3 : -2]], dtype=int)[:, 1:]
    corners = points[cells - 1]
    return float(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum() / 6)


def test_plane_mesh_is_kept_with_its_groups(tmp_path):
    drawing = read_drawing(write_beam_mesh(tmp_path / "beam.msh", groups=("base", "contact", "markers")))
    assert drawing.mesh is not None
    assert {"base", "contact"} <= set(drawing.loops[0].names)
    assert drawing.markers.tolist() == [[5, 50]]
    assert area(drawing) == pytest.approx(1000)
    assert read_drawing(write_beam_mesh(tmp_path / "bare.msh", groups=())).mesh is None


def test_dxf_curves_and_units(tmp_path):
    document = ezdxf.new(units=6)  # m
    space = document.modelspace()
    space.add_ellipse((0, 0), major_axis=(0.03, 0), ratio=0.5)
    space.add_spline(fit_points=[(0.01, 0), (0, 0.005), (-0.01, 0), (0, -0.005), (0.01, 0)])
    space.add_text("a title")
    path = tmp_path / "curves.dxf"
    document.saveas(path)
    drawing = read_drawing(path)
    assert drawing.unit == 1000
    assert drawing.loops[0].area == pytest.approx(np.pi * 30 * 15, rel=1e-4)
    spline = next(entity for entity in space if entity.dxftype() == "SPLINE")
    polygon = np.array([(point.x, point.y) for point in spline.flattening(1e-9)]) * 1000  # type: ignore[attr-defined]
    x, y = polygon.T
    shoelace = 0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum()
    assert drawing.loops[1].area == pytest.approx(shoelace, rel=1e-4)
    assert read_drawing(path, units="in").unit == 25.4


def test_dxf_blocks_with_mirrored_arcs(tmp_path):
    document = ezdxf.new(units=4)
    block = document.blocks.new("half")
    block.add_line((10, 0), (-10, 0))
    block.add_arc((0, 0), 10, 0, 180)
    document.modelspace().add_blockref("half", (5, 5), dxfattribs={"xscale": -1})
    document.modelspace().add_point((5, 15), dxfattribs={"layer": "Contact"})
    path = tmp_path / "half.dxf"
    document.saveas(path)
    drawing = read_drawing(path)
    assert [abs(loop.area) for loop in drawing.loops] == pytest.approx([50 * np.pi])
    assert drawing.contact == pytest.approx([5, 15])
    assert drawing.loops[0].bounds == pytest.approx(np.array([[-5, 5], [15, 15]]))


def test_svg_transformations_units_and_names(tmp_path):
    svg = """<g id="outline" transform="translate(10 20) scale(2)">
      <path d="M0 0 h30 v10 a5 5 0 0 1 -5 5 h-25 z"/><ellipse cx="10" cy="5" rx="4" ry="2"/></g>
      <g id="markers"><circle cx="12" cy="22" r="0.5"/></g>"""
    path = write_svg(tmp_path / "a.svg", svg, 'width="10cm" height="6cm" viewBox="-3 -4 50 30"')
    drawing = read_drawing(path)
    outer = 30 * 15 - (25 - 25 * np.pi / 4)  # a quarter disc off one corner
    sizes = sorted(abs(loop.area) / 16 for loop in drawing.loops)  # 2 mm in a unit, twice as large
    assert sizes == pytest.approx([8 * np.pi, outer], rel=1e-4)
    assert drawing.markers == pytest.approx(np.array([[24, -44]]))
    assert drawing.marker_diameter == pytest.approx(2)
    assert read_drawing(path, units="mm").markers == pytest.approx(np.array([[12, -22]]))


def test_svg_circles_under_a_skew_are_ellipses_and_copies_are_shapes(tmp_path):
    svg = """<defs><rect id="hole" width="4" height="3"/></defs><use href="#hole" x="40" y="30"/>
      <g transform="skewX(20) scale(2 1)"><circle cx="15" cy="30" r="12"/></g>"""
    outline, hole = read_drawing(write_svg(tmp_path / "a.svg", svg)).loops[::-1]
    assert abs(outline.area) == pytest.approx(2 * np.pi * 144, rel=1e-4)
    assert np.ptp(outline.bounds[:, 0]) == pytest.approx(24 * np.hypot(2, np.tan(np.radians(20))), rel=1e-4)
    assert hole.bounds == pytest.approx(np.array([[40, -33], [44, -30]]))


@pytest.mark.parametrize("name", ["a.msh", "beam.msh.opt"])
def test_no_script_of_gmsh_is_run(tmp_path, name):
    """Gmsh runs every file that is no mesh, and one beside a mesh that has its name."""
    write_beam_mesh(tmp_path / "beam.msh", groups=())
    mark = tmp_path / "was-run"
    (tmp_path / name).write_text(f'Printf("run") > "{mark}";\n')
    with suppress(UserError):
        read_drawing(tmp_path / name.removesuffix(".opt"))
    assert not mark.exists()

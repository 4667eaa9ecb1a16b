"""Drawings that the tests of the readers share."""

from collections.abc import Sequence
from pathlib import Path

import ezdxf
import gmsh

DATA = Path(__file__).parents[2] / "data"
FINRAY = DATA / "compliant-finray"
CSIRO = DATA / "csiro-finger" / "finray_test_vol.msh"

BEAM = ((0.0, 0.0), (0.0, -10.0), (100.0, -10.0), (100.0, 0.0))


def rectangle(x: float, y: float, width: float, height: float) -> list[tuple[float, float]]:
    return [(x, y), (x + width, y), (x + width, y + height), (x, y + height)]


def write_dxf(
    path: Path, curves: Sequence[Sequence[tuple[float, float]]], *, units: int = 4, closed: bool = True
) -> Path:
    """Polygons as DXF polylines; 4 are mm."""
    document = ezdxf.new(units=units)
    for corners in curves:
        document.modelspace().add_lwpolyline(corners, close=closed)
    document.saveas(path)
    return path


def write_svg(path: Path, body: str, head: str = 'width="100mm" height="60mm" viewBox="0 0 100 60"') -> Path:
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" {head}>{body}</svg>')
    return path


def write_beam_mesh(path: Path, *, groups: Sequence[str] = ("base", "contact"), size: float = 2.0) -> Path:
    """A beam of 100 mm by 10 mm, clamped at the left, touched at x = 40 to 44, turned by a quarter."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("beam")
        corners = [(0, 0), (0, -10), (100, -10), (100, 0), (44, 0), (40, 0)]
        tags = [gmsh.model.geo.addPoint(-y, x, 0, size) for x, y in corners]
        marker = gmsh.model.geo.addPoint(5, 50, 0, size)
        lines = [gmsh.model.geo.addLine(a, b) for a, b in zip(tags, tags[1:] + tags[:1], strict=True)]
        surface = gmsh.model.geo.addPlaneSurface([gmsh.model.geo.addCurveLoop(lines)])
        gmsh.model.geo.synchronize()
        gmsh.model.mesh.embed(0, [marker], 2, surface)
        for name, numbers in {"base": [0], "contact": [4], "front": [3, 4, 5]}.items():
            if name in groups:
                gmsh.model.addPhysicalGroup(1, [lines[number] for number in numbers], name=name)
        if "markers" in groups:
            gmsh.model.addPhysicalGroup(0, [marker], name="markers")
        gmsh.model.addPhysicalGroup(2, [surface], name="body")
        gmsh.model.mesh.generate(2)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return path


def broken_dxf(path: Path, kind: str) -> Path:
    """The beam in a DXF file with something that cannot be read."""
    document = ezdxf.new(units=4)
    space = document.modelspace()
    space.add_lwpolyline(BEAM, close=True)
    if kind == "missing":
        space.add_blockref("bracket", (0, 0))
    elif kind == "missing within":
        document.blocks.new("outer").add_blockref("bracket", (0, 0))
        space.add_blockref("outer", (0, 0))
    elif kind == "itself":
        document.blocks.new("ring").add_blockref("RING", (0, 0))
        space.add_blockref("ring", (0, 0))
    elif kind == "each other":
        document.blocks.new("one").add_blockref("two", (0, 0))
        document.blocks.new("two").add_blockref("one", (0, 0))
        space.add_blockref("one", (0, 0))
    elif kind == "grid":
        document.blocks.new("dot").add_circle((0, 0), 1)
        space.add_blockref("dot", (0, 0), dxfattribs={"row_count": 30000, "column_count": 30000})
    elif kind in ("knots", "weights"):
        spline = space.add_open_spline([(8, -4), (9, -5), (10, -4), (11, -5)])
        spline.knots = [0, 0, 0, 0, 1, 1] if kind == "knots" else spline.knots
        spline.weights = [1, 1] if kind == "weights" else []
    elif kind == "unread":
        space.add_3dface([(0, 0), (1, 0), (1, 1)])
    document.saveas(path)
    return path

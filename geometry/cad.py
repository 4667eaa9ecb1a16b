"""A finger as CAD: the section's face, the solid with its markers as separate bodies, and their files.

The only module that imports CadQuery; import it where it is used.
"""

import tempfile
from collections.abc import Sequence
from errno import EIO
from pathlib import Path

import cadquery as cq
from cadquery.occ_impl.exporters.dxf import DxfDocument

from pinnray.geometry.finger.finger import Finger, outline_with_contact
from pinnray.geometry.section.loop import Loop
from pinnray.runtime.arrays import FloatArray

LABELLED = {"base": 5, "contact": 30}
"""Layers of a DXF file that name parts of the outline, with their colours' numbers."""


def solids(finger: Finger) -> tuple[cq.Shape, tuple[cq.Solid, ...]]:
    """The body with a pocket for every marker, and the markers that fill them, ordered from base to tip.

    The section lies in z = 0 to `depth`; markers are inlaid `marker_height` deep into the face z = `depth`.
    """
    outer, cavities = _wires(finger)
    radius, height, bottom = finger.marker_radius, finger.marker_height, finger.depth - finger.marker_height
    markers = tuple(
        cq.Solid.makeCylinder(radius, height, pnt=cq.Vector(x, y, bottom)) for x, y in finger.markers
    )
    body = cq.Solid.extrudeLinear(outer, cavities, cq.Vector(0, 0, finger.depth)).cut(*markers)
    return body, markers


def assembly(finger: Finger) -> cq.Assembly:
    """The named and coloured parts `body`, `marker-1`, `marker-2`, ..."""
    body, markers = solids(finger)
    whole = cq.Assembly(name="finger")
    whole.add(body, name="body", color=cq.Color(0.15, 0.15, 0.17))
    for number, marker in enumerate(markers, start=1):
        whole.add(marker, name=f"marker-{number}", color=cq.Color(0.95, 0.25, 0.1))
    return whole


def write_step(finger: Finger, folder: Path) -> list[Path]:
    """The assembly as STEP, mm."""
    path = folder / "finger.step"
    assembly(finger).export(str(path))
    return [path]


def write_stl(finger: Finger, folder: Path) -> list[Path]:
    """Body and markers as two STL files in one frame, mm: one for each material of the printer."""
    body, markers = solids(finger)
    paths = [folder / "finger-body.stl", folder / "finger-markers.stl"]
    for shape, path in zip((body, cq.Compound.makeCompound(markers)), paths, strict=True):
        shape.exportStl(str(path), tolerance=0.01, angularTolerance=0.1)  # mm, rad
    return paths


def write_dxf(finger: Finger, folder: Path) -> list[Path]:
    """The section as DXF, mm, with the layers `outline` and `markers`.

    Lines and arcs of the layers `base` and `contact` lie on the outline and name its parts.
    """
    path = folder / "section.dxf"
    outer, cavities = _wires(finger)
    circles = [
        cq.Wire.makeCircle(finger.marker_radius, cq.Vector(x, y, 0), cq.Vector(0, 0, 1))
        for x, y in finger.markers
    ]
    document = DxfDocument(approx=None)
    document.add_layer("outline", color=7)
    document.add_layer("markers", color=1)
    document.add_shape(cq.Workplane("XY").newObject([outer, *cavities]), "outline")
    document.add_shape(cq.Workplane("XY").newObject(circles), "markers")
    named = outline_with_contact(finger)
    for label, colour in LABELLED.items():
        document.add_layer(label, color=colour)
        parts = [_edge(named, which) for which in named.pieces(label)]
        document.add_shape(cq.Workplane("XY").newObject(parts), label)
    document.document.saveas(str(path))
    return [path]


WRITERS = {"step": write_step, "stl": write_stl, "dxf": write_dxf}
"""The writer of each format, into a folder."""


def cad_contents(finger: Finger, formats: Sequence[str]) -> dict[str, bytes]:
    """The contents of a finger's CAD files in some formats, by name."""
    with tempfile.TemporaryDirectory() as folder:
        files = [file for name in formats for file in WRITERS[name](finger, Path(folder))]
        return {file.name: _whole(file) for file in files}


def _whole(path: Path) -> bytes:
    """The content of a file; an `OSError` if it has no end: OpenCASCADE does not say that a disk is full."""
    content = path.read_bytes()
    if path.suffix == ".stl":  # a head, whose last number counts the triangles, and 50 bytes for each
        whole = len(content) == 84 + 50 * int.from_bytes(content[80:84], "little")
    else:
        end = {".step": b"END-ISO-10303-21;", ".dxf": b"EOF"}[path.suffix]
        whole = content.rstrip().endswith(end)
    if not whole:
        raise OSError(EIO, "a part was not written; is the disk full?", str(path))
    return content


def _wires(finger: Finger) -> tuple[cq.Wire, list[cq.Wire]]:
    shape = finger.section
    return _wire(shape.outline), [_wire(cavity) for cavity in shape.cavities]


def _wire(loop: Loop) -> cq.Wire:
    """A closed curve; its arcs are exact."""
    return cq.Wire.assembleEdges([_edge(loop, which) for which in range(len(loop.points))])


def _edge(loop: Loop, which: int) -> cq.Edge:
    start, end = map(_vector, loop.ends[which])
    if which in loop.straight:
        return cq.Edge.makeLine(start, end)
    return cq.Edge.makeThreePointArc(start, _vector(loop.along(which, 0.5)[0]), end)


def _vector(point: FloatArray) -> cq.Vector:
    return cq.Vector(float(point[0]), float(point[1]), 0)

"""The finger as CAD: the section's face, the solid with its markers as separate bodies, and their files.

The only module that imports CadQuery; import it where it is used.
"""

import tempfile
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import cadquery as cq
from cadquery.occ_impl.exporters.dxf import DxfDocument

from geometry.arrays import FloatArray
from geometry.finger.parameters import Parameters
from geometry.finger.section import fillet_points, finger_section, marker_positions
from geometry.finger.svg import section_svg

BODY_COLOUR = (0.15, 0.15, 0.17)
MARKER_COLOUR = (0.95, 0.25, 0.1)
STL_TOLERANCE = 0.01
"""Largest distance of an STL facet from the surface, mm."""


def section_face(parameters: Parameters) -> cq.Face:
    """The section as one planar face at z = 0 with the cavities as holes."""
    outer, cavities = _wires(parameters)
    return cq.Face.makeFromWires(outer, cavities)


def section_brep(parameters: Parameters, path: Path) -> Path:
    """Write the section's face as a BREP file."""
    section_face(parameters).exportBrep(str(path))
    return path


def solids(parameters: Parameters) -> tuple[cq.Shape, tuple[cq.Solid, ...]]:
    """The body with a pocket for every marker, and the markers that fill them, ordered from base to tip.

    The section lies in z = 0 to `depth`; markers are inlaid `marker_height` deep into the face z = `depth`.
    """
    p = parameters
    outer, cavities = _wires(p)
    markers = tuple(
        cq.Solid.makeCylinder(
            p.marker_radius, p.marker_height, pnt=cq.Vector(x, y, p.depth - p.marker_height)
        )
        for x, y in marker_positions(p)
    )
    body = cq.Solid.extrudeLinear(outer, cavities, cq.Vector(0, 0, p.depth)).cut(*markers)
    return body, markers


def assembly(parameters: Parameters) -> cq.Assembly:
    """The named and coloured parts `body`, `marker-1`, `marker-2`, ..."""
    body, markers = solids(parameters)
    whole = cq.Assembly(name="finger")
    whole.add(body, name="body", color=cq.Color(*BODY_COLOUR))
    for number, marker in enumerate(markers, start=1):
        whole.add(marker, name=f"marker-{number}", color=cq.Color(*MARKER_COLOUR))
    return whole


def write_step(parameters: Parameters, folder: Path) -> list[Path]:
    """The assembly as STEP, mm."""
    path = folder / "finger.step"
    assembly(parameters).export(str(path))
    return [path]


def write_stl(parameters: Parameters, folder: Path) -> list[Path]:
    """Body and markers as two STL files in one frame, mm: one for each material of the printer."""
    body, markers = solids(parameters)
    paths = [folder / "finger-body.stl", folder / "finger-markers.stl"]
    for shape, path in zip((body, cq.Compound.makeCompound(markers)), paths, strict=True):
        shape.exportStl(str(path), tolerance=STL_TOLERANCE, angularTolerance=0.1)
    return paths


def write_dxf(parameters: Parameters, folder: Path) -> list[Path]:
    """The section as DXF, mm, with the layers `outline` and `markers`."""
    path = folder / "section.dxf"
    outer, cavities = _wires(parameters)
    circles = [
        cq.Wire.makeCircle(parameters.marker_radius, cq.Vector(x, y, 0), cq.Vector(0, 0, 1))
        for x, y in marker_positions(parameters)
    ]
    document = DxfDocument(approx=None)
    document.add_layer("outline", color=7)
    document.add_layer("markers", color=1)
    document.add_shape(cq.Workplane("XY").newObject([outer, *cavities]), "outline")
    document.add_shape(cq.Workplane("XY").newObject(circles), "markers")
    document.document.saveas(str(path))
    return [path]


def write_svg(parameters: Parameters, folder: Path) -> list[Path]:
    """The section as SVG in true scale."""
    path = folder / "section.svg"
    path.write_text(section_svg(parameters), encoding="utf-8")
    return [path]


WRITERS: Mapping[str, Callable[[Parameters, Path], list[Path]]] = {
    "step": write_step,
    "stl": write_stl,
    "dxf": write_dxf,
    "svg": write_svg,
}
"""The writer of each format, into a folder."""


def write_archive(parameters: Parameters, formats: Sequence[str], path: Path) -> None:
    """Write the files of some formats into one ZIP archive."""
    with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in formats:
            for file in WRITERS[name](parameters, Path(folder)):
                archive.write(file, file.name)


def _wires(parameters: Parameters) -> tuple[cq.Wire, list[cq.Wire]]:
    shape = finger_section(parameters)
    outer = cq.Wire.makePolygon([_vector(corner) for corner in shape.outer], close=True)
    return outer, [_cavity_wire(cavity, shape.fillet_radius) for cavity in shape.cavities]


def _cavity_wire(corners: FloatArray, radius: float) -> cq.Wire:
    """A cavity's outline; with a radius, every corner is an arc between its two points of tangency."""
    if radius == 0:
        return cq.Wire.makePolygon([_vector(corner) for corner in corners], close=True)
    arcs = [fillet_points(corners, which, radius) for which in range(len(corners))]
    edges: list[cq.Edge] = []
    for (start, middle, end), (following, _, _) in zip(arcs, arcs[1:] + arcs[:1], strict=True):
        edges.append(cq.Edge.makeThreePointArc(_vector(start), _vector(middle), _vector(end)))
        edges.append(cq.Edge.makeLine(_vector(end), _vector(following)))
    return cq.Wire.assembleEdges(edges)


def _vector(point: FloatArray) -> cq.Vector:
    return cq.Vector(float(point[0]), float(point[1]), 0)

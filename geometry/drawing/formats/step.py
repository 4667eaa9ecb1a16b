"""Reads the section of a STEP file: the cap of an extruded solid, or the cut of a solid with a plane.

With `step_parts` and `pinnray.geometry.cad` the only module that imports CadQuery.
"""

from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import NamedTuple

import cadquery as cq
import numpy as np
from OCP.BRep import BRep_Tool
from OCP.GeomLProp import GeomLProp_SLProps

from pinnray.geometry.drawing.formats.closed_loops import closed_loops
from pinnray.geometry.drawing.formats.drawing import UNITS, Drawing, Scale
from pinnray.geometry.drawing.formats.pieces import Piece, arcs_along, line
from pinnray.geometry.drawing.formats.planes import axes_across, plane_of, plane_text
from pinnray.geometry.drawing.formats.step_parts import parts_of
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError

PARALLEL = 1e-6
"""Largest sine of the angle of two parallel directions."""


class Cut(NamedTuple):
    """A plane section of a solid."""

    faces: Sequence[cq.Face]
    normal: FloatArray  # of the plane, unit vector (3,)
    offset: float  # of the plane from the origin along the normal, mm
    depth: float  # of the solid along the normal, mm
    is_extruded: bool = True


def read_step(
    path: Path, units: str | None = None, tolerance: float | None = None, plane: str | None = None
) -> Drawing:
    """The section of the one solid of a STEP file, with the markers that are parts called `marker-1`, ...

    Args:
        path: The file.
        units: Unit in which the file's numbers are read; None means mm.
        tolerance: Largest gap between two ends that is closed, mm; None means 0.001 mm.
        plane: Plane of the cut, such as `z = 6`; None means across an extruded solid.
    """
    parts = parts_of(path)
    bodies = [part for part in parts if not part.is_marker]
    markers = [part.solid for part in parts if part.is_marker]
    if len(bodies) != 1:
        found = ", ".join(map(str, bodies[:12])) + (", ..." if len(bodies) > 12 else "")
        raise UserError(
            f"it holds {len(bodies)} solids besides markers{': ' + found if found else ''}; keep "
            "one, and call the others marker-1, marker-2, ... if they are markers"
        )
    solid = _filled(bodies[0].solid, markers)
    scale = Scale(UNITS[units], units, "given") if units else Scale(origin="of the file")
    unit = scale.length
    cut = _cut_at(solid, *plane_of(plane)) if plane else _across(solid)
    axes = axes_across(cut.normal)
    pieces = [
        piece
        for face in _united(cut.faces)
        for wire in face.Wires()
        for edge in wire.Edges()
        for piece in _pieces(edge, axes, unit)
    ]
    centres, diameters, heights = _discs(markers, axes, cut.normal)
    depth = f"{cut.depth * unit:.6g} mm"
    how = f"extruded by {depth}" if cut.is_extruded else f"cut, {depth} across"
    closed = closed_loops(pieces, scale=scale, tolerance=tolerance)
    return Drawing(
        loops=closed.loops,
        unit=unit,
        note=f"STEP, {how}, at {plane_text(cut.normal, cut.offset)}{closed.note}",
        markers=centres * unit,
        marker_diameter=float(np.mean(diameters)) * unit if markers else None,
        marker_height=float(np.mean(heights)) * unit if markers else None,
        depth=cut.depth * unit,
    )


def _united(faces: Sequence[cq.Face]) -> Sequence[cq.Face]:
    """Faces of one plane without the edges between them."""
    if len(faces) < 2:
        return faces
    whole = faces[0].fuse(*faces[1:]).clean().Faces()
    area, before = (sum(face.Area() for face in each) for each in (whole, faces))
    return whole if 0 < area < before * (1 + 1e-9) else faces


def _filled(body: cq.Solid, markers: Sequence[cq.Solid]) -> cq.Solid:
    """The body with its markers in their pockets; the body alone if they do not touch it."""
    whole = body.fuse(*markers).clean().Solids() if markers else [body]
    return whole[0] if len(whole) == 1 else body


def _across(solid: cq.Solid) -> Cut:
    """The section of an extruded solid: of a box, across z, else across the smallest of its sides.

    Pockets that do not reach half the depth, as for markers, are left out.
    """
    normals = _directions(solid)
    fitting = [normal for normal in normals if _is_extruded(solid, normal)]
    for normal in sorted(fitting, key=lambda normal: -abs(normal[2])):
        low, high = _extent(solid, normal)
        middle = _cut_at(solid, normal, 0.5 * (low + high))
        area = sum(face.Area() for face in middle.faces)
        for offset in (low, high):  # a cap has the edges of the file
            cap = [
                face
                for face in solid.Faces()
                if face.geomType() == "PLANE"
                and np.linalg.norm(np.cross(_array(face.normalAt()), normal)) < PARALLEL
                and abs(float(_array(face.Center()) @ normal) - offset) < 1e-6
            ]
            if abs(sum(face.Area() for face in cap) - area) < 1e-7 * area:
                return Cut(cap, normal, offset, high - low)
        if area * (high - low) > 0.5 * solid.Volume():
            return Cut(middle.faces, normal, 0.5 * (low + high), high - low)
    raise UserError('the solid is not extruded; give the plane of the section, such as plane = "z = 6"')


def _directions(solid: cq.Solid) -> list[FloatArray]:
    """Normals of the planar faces, each direction once."""
    found: list[FloatArray] = []
    for face in solid.Faces():
        if face.geomType() == "PLANE":
            normal = _array(face.normalAt())
            normal = normal * np.sign(normal[np.abs(normal).argmax()])
            if all(np.linalg.norm(np.cross(normal, other)) > PARALLEL for other in found):
                found.append(normal)
    return found


def _is_extruded(solid: cq.Solid, normal: FloatArray) -> bool:
    """Whether every face is parallel to the direction `normal`, or plane and across it."""
    for face in solid.Faces():
        slopes = [abs(float(each @ normal)) for each in _normals(face)]
        if slopes and not (max(slopes) < PARALLEL or min(slopes) > 1 - PARALLEL):
            return False
    return True


def _normals(face: cq.Face) -> Iterator[FloatArray]:
    """Normals over a face, where they are defined: not at the tip of a cone or of a degenerate patch."""
    low_u, high_u, low_v, high_v = face._uvBounds()
    surface = GeomLProp_SLProps(BRep_Tool.Surface_s(face.wrapped), 1, 1e-9)
    for u, v in product(np.linspace(low_u, high_u, 5), np.linspace(low_v, high_v, 5)):
        surface.SetParameters(float(u), float(v))
        if surface.IsNormalDefined():
            normal = surface.Normal()
            yield np.array([normal.X(), normal.Y(), normal.Z()])


def _cut_at(solid: cq.Solid, normal: FloatArray, offset: float) -> Cut:
    """The cut of a solid with a plane; its depth is the solid's extent across the plane."""
    low, high = _extent(solid, normal)
    if not low - 1e-6 <= offset <= high + 1e-6:  # an end face is in a plane that may be meant
        raise UserError(
            f"the plane {plane_text(normal, offset)} misses the solid, which reaches from {low:.6g} to "
            f"{high:.6g} mm along that direction"
        )
    size = 4 * solid.BoundingBox().DiagonalLength + abs(offset)
    plane = cq.Face.makePlane(size, size, cq.Vector(*(normal * offset)), cq.Vector(*normal))
    middle = _array(solid.BoundingBox().center)
    shift = middle - normal * (middle @ normal)
    faces = plane.moved(cq.Location(cq.Vector(*shift))).intersect(solid).Faces()
    if not faces:
        raise UserError(
            f"the plane {plane_text(normal, offset)} only touches the solid; move it into the solid"
        )
    return Cut(faces, normal, offset, high - low, _is_extruded(solid, normal))


def _extent(solid: cq.Solid, normal: FloatArray) -> tuple[float, float]:
    """Where the solid begins and ends along a direction, mm."""
    plane = cq.Plane(origin=(0, 0, 0), xDir=tuple(axes_across(normal)[0]), normal=tuple(normal))
    box = solid.moved(cq.Location(plane).inverse).BoundingBox()
    return float(box.zmin), float(box.zmax)


def _pieces(edge: cq.Edge, axes: FloatArray, unit: float) -> Iterator[Piece]:
    """An edge in the plane spanned by two axes (2, 3), mm of the file."""
    first, last = edge._bounds()

    def on_edge(parameters: FloatArray) -> FloatArray:
        points = [_array(edge.positionAt(float(t), mode="parameter")) for t in parameters]
        return unit * (np.array(points) @ axes.T)

    if edge.geomType() == "LINE":
        start, end = on_edge(np.array([first, last]))
        yield line(start, end, "")
    else:
        yield from arcs_along(on_edge, first, last, "")


def _discs(
    markers: Sequence[cq.Solid], axes: FloatArray, normal: FloatArray
) -> tuple[FloatArray, list[float], list[float]]:
    """Centres (m, 2), diameters and heights of markers; each is taken for a cylinder of its volume."""
    centres = [axes @ _array(marker.Center()) for marker in markers]
    heights = [high - low for low, high in (_extent(marker, normal) for marker in markers)]
    diameters = [
        float(np.sqrt(4 * marker.Volume() / (np.pi * height)))
        for marker, height in zip(markers, heights, strict=True)
    ]
    return np.array(centres).reshape(-1, 2), diameters, heights


def _array(vector: cq.Vector) -> FloatArray:
    return np.array(vector.toTuple(), dtype=np.float64)

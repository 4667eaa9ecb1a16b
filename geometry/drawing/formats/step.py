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
    """A section of a solid, turned so that it lies across z."""

    faces: Sequence[cq.Face]
    frame: cq.Location  # from the turned solid's frame into the file's
    offset: float  # of the section along z, mm
    depth: float  # of the solid along z, mm
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
    pieces = [
        piece
        for face in _united(cut.faces)
        for wire in face.Wires()
        for edge in wire.Edges()
        for piece in _pieces(edge, unit)
    ]
    discs = np.array([_disc(marker.moved(cut.frame.inverse)) for marker in markers]).reshape(-1, 4) * unit
    depth = f"{cut.depth * unit:.6g} mm"
    how = f"extruded by {depth}" if cut.is_extruded else f"cut, {depth} across"
    closed = closed_loops(pieces, scale=scale, tolerance=tolerance)
    normal = _array(cq.Plane(cut.frame).zDir)
    return Drawing(
        loops=closed.loops,
        unit=unit,
        note=f"STEP, {how}, at {plane_text(normal, cut.offset)}{closed.note}",
        markers=discs[:, :2],
        marker_diameter=float(discs[:, 2].mean()) if markers else None,
        marker_height=float(discs[:, 3].mean()) if markers else None,
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
    for normal in sorted(_directions(solid), key=lambda normal: -abs(normal[2])):
        frame, turned = _turned(solid, normal)
        if not _is_extruded(turned):
            continue
        low, high = _extent(turned)
        middle = _section(turned, 0.5 * (low + high))
        area = sum(face.Area() for face in middle)
        for offset in (low, high):  # a cap has the edges of the file
            cap = [face for face in turned.Faces() if np.abs(np.subtract(_extent(face), offset)).max() < 1e-6]
            if abs(sum(face.Area() for face in cap) - area) < 1e-7 * area:
                return Cut(cap, frame, offset, high - low)
        if area * (high - low) > 0.5 * solid.Volume():
            return Cut(middle, frame, 0.5 * (low + high), high - low)
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


def _is_extruded(turned: cq.Shape) -> bool:
    """Whether every face is parallel to z, or plane and across it."""
    for face in turned.Faces():
        slopes = [abs(float(normal[2])) for normal in _normals(face)]
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
    frame, turned = _turned(solid, normal)
    sign = float(np.sign(_array(cq.Plane(frame).zDir) @ normal))
    height = sign * offset
    low, high = _extent(turned)
    if not low - 1e-6 <= height <= high + 1e-6:  # an end face is in a plane that may be meant
        ends = sorted((sign * low, sign * high))
        raise UserError(
            f"the plane {plane_text(normal, offset)} misses the solid, which reaches from {ends[0]:.6g} to "
            f"{ends[1]:.6g} mm along that direction"
        )
    faces = _section(turned, height)
    if not faces:
        raise UserError(
            f"the plane {plane_text(normal, offset)} only touches the solid; move it into the solid"
        )
    return Cut(faces, frame, height, high - low, _is_extruded(turned))


def _turned(solid: cq.Solid, normal: FloatArray) -> tuple[cq.Location, cq.Shape]:
    """A frame whose z axis is along a direction, either way, and the solid as it is seen there."""
    axes = axes_across(normal)
    plane = cq.Plane(origin=(0, 0, 0), xDir=tuple(axes[0]), normal=tuple(np.cross(*axes)))
    return cq.Location(plane), solid.moved(cq.Location(plane).inverse)


def _extent(shape: cq.Shape) -> tuple[float, float]:
    """Where a shape begins and ends along z, mm."""
    box = shape.BoundingBox()
    return float(box.zmin), float(box.zmax)


def _section(shape: cq.Shape, height: float) -> list[cq.Face]:
    """The faces in which a shape is cut across z at a height, mm."""
    box = shape.BoundingBox()
    size = 4 * box.DiagonalLength
    plane = cq.Face.makePlane(size, size, cq.Vector(box.center.x, box.center.y, height))
    return plane.intersect(shape).Faces()


def _pieces(edge: cq.Edge, unit: float) -> Iterator[Piece]:
    """An edge in a plane across z, mm of the file."""
    first, last = edge._bounds()

    def on_edge(parameters: FloatArray) -> FloatArray:
        points = [_array(edge.positionAt(float(t), mode="parameter")) for t in parameters]
        return unit * np.array(points)[:, :2]

    if edge.geomType() == "LINE":
        start, end = on_edge(np.array([first, last]))
        yield line(start, end, "")
    else:
        yield from arcs_along(on_edge, first, last, "")


def _disc(marker: cq.Shape) -> tuple[float, float, float, float]:
    """Centre, diameter and height of a marker, which is taken for a cylinder of its volume along z, mm."""
    low, high = _extent(marker)
    centre = marker.Center()
    return centre.x, centre.y, float(np.sqrt(4 * marker.Volume() / (np.pi * (high - low)))), high - low


def _array(vector: cq.Vector) -> FloatArray:
    return np.array(vector.toTuple(), dtype=np.float64)

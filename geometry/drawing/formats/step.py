"""Reads the section of a STEP file: the cap of an extruded solid, or the cut of a solid with a plane.

With `step_parts` and `pinnray.geometry.cad` the only module that imports CadQuery.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import cadquery as cq
import numpy as np

from pinnray.geometry.drawing.formats.closed_loops import closed_loops
from pinnray.geometry.drawing.formats.drawing import UNITS, Drawing, MarkerSize, Scale
from pinnray.geometry.drawing.formats.pieces import Piece, arcs_along, line
from pinnray.geometry.drawing.formats.planes import axes_across, plane_of, plane_text
from pinnray.geometry.drawing.formats.step_parts import parts_of
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError

PARALLEL = 1e-6
"""Largest sine of the angle of two parallel directions."""

SAME = 0.005
"""Volume in which an extruded solid may differ from its section times its depth, as a share: for pockets."""


class Cut(NamedTuple):
    """A section of a solid or of a layer of it, turned so that it lies across z."""

    faces: Sequence[cq.Face]
    frame: cq.Location  # from the turned solid's frame into the file's
    offset: float  # of the section along z, mm
    depth: float  # of the solid or layer along z, mm

    @property
    def area(self) -> float:
        """Area, mm^2."""
        return float(sum(face.Area() for face in self.faces))

    @property
    def volume(self) -> float:
        """Area times depth, mm^3."""
        return self.area * self.depth

    @property
    def plane(self) -> str:
        """The plane in words, such as `z = 6`."""
        return plane_text(_array(cq.Plane(self.frame).zDir), self.offset)


def read_step(
    path: Path,
    units: str | None = None,
    tolerance: float | None = None,
    plane: str | None = None,
    *,
    depth_known: bool = False,
) -> Drawing:
    """The section of the one solid of a STEP file, with the markers that are parts called `marker-1`, ...

    Args:
        path: The file.
        units: Unit in which the file's numbers are read; None means mm.
        tolerance: Largest gap between two ends that is closed, mm; None means 0.001 mm.
        plane: Plane of the cut, such as `z = 6`; None means across an extruded solid, or where the section
            of another one is largest.
        depth_known: Whether the depth is given, so that the solid need not be extruded.

    Raises:
        UserError: If the solid is not its section times its depth, and the depth is not given.
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
    turned, cut = _cut_at(solid, *plane_of(plane)) if plane else _across(solid)
    apart = _apart(turned, cut)
    if apart > SAME and not depth_known:
        deep = _depths(_layers(turned, cut.frame))
        depth = max(deep, key=np.prod)[1]
        sections = ", ".join(f"{area * unit**2:.4g} mm2 over {depth * unit:.4g} mm" for area, depth in deep)
        raise UserError(
            f"the solid is not extruded: across {cut.plane} its section is {sections}, and its volume "
            f"{turned.Volume() * unit**3:.5g} mm3; give the depth of the finger and its plane, such as "
            f'depth = {depth:.4g} and plane = "{cut.plane}"'
        )
    faces = _united(cut.faces)
    if len(faces) > 1:
        raise UserError(
            f"at {cut.plane} it is cut into {len(faces)} pieces; give a plane that cuts it into one"
        )
    edges = [edge for face in faces for wire in face.Wires() for edge in wire.Edges()]
    pieces = [piece for edge in edges for piece in _pieces(edge, unit)]
    discs = np.array([_disc(marker.moved(cut.frame.inverse)) for marker in markers]).reshape(-1, 4) * unit
    size, across = MarkerSize.of(discs[:, 2]), f"{cut.depth * unit:.6g} mm"
    whole = f"{turned.Volume() * unit**3:.5g} mm3"
    how = f"extruded by {across}" if apart <= SAME else f"cut, {across} across, of a solid of {whole}"
    how += f" but for {100 * apart:.2g} % of the volume" if 1e-6 < apart <= SAME else ""
    closed = closed_loops(pieces, scale=scale, tolerance=tolerance)
    return Drawing(
        loops=closed.loops,
        unit=unit,
        note=f"STEP, {how}, at {cut.plane}{closed.note}{size.note}",
        markers=discs[:, :2],
        marker_diameter=size.diameter,
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
    """The body with its markers in their pockets; the body alone if they are outside it or stand out."""
    whole = body.fuse(*markers).clean().Solids() if markers else [body]
    size, before = (each.BoundingBox().DiagonalLength for each in (whole[0], body))
    return whole[0] if len(whole) == 1 and size < before + 1e-6 else body


def _across(solid: cq.Solid) -> tuple[cq.Shape, Cut]:
    """The solid seen along the direction in which it is extruded, and its section: of a box, across z.

    Of a solid that is not extruded, the direction in which one layer is about all of it.
    """
    found = list[tuple[float, cq.Shape, Cut]]()
    for normal in sorted(_directions(solid), key=lambda normal: -abs(normal[2])):
        frame, turned = _turned(solid, normal)
        low, high = _extent(turned)
        layer = max(_layers(turned, frame), key=lambda layer: layer.volume)
        cut = layer._replace(depth=high - low)
        apart, shown = _apart(turned, cut), abs(layer.volume / solid.Volume() - 1)
        for offset in (low, high) if apart <= SAME else ():  # a cap has the edges of the file
            cap = [face for face in turned.Faces() if np.abs(np.subtract(_extent(face), offset)).max() < 1e-6]
            if abs(sum(face.Area() for face in cap) - cut.area) < 1e-7 * cut.area:
                cut = cut._replace(faces=cap, offset=offset)
                break
        found.append((round(apart, 7) if apart <= SAME else 1 + round(shown, 1), turned, cut))
    if not found:
        raise UserError('the solid has no flat face; give depth, and the plane, such as plane = "z = 6"')
    _, turned, cut = min(found, key=lambda each: each[0])
    return turned, cut


def _apart(turned: cq.Shape, cut: Cut) -> float:
    """Volume in which a solid and its section times its depth differ, as a share of the solid's."""
    low, volume = _extent(turned)[0], turned.Volume()
    if abs(cut.volume - volume) > SAME * volume:
        return abs(cut.volume - volume) / volume
    lower, along = cq.Location(cq.Vector(0, 0, low - cut.offset)), cq.Vector(0, 0, cut.depth)
    prisms = [cq.Solid.extrudeLinear(face.moved(lower), along) for face in cut.faces]
    return (volume + cut.volume - 2 * sum(turned.intersect(prism).Volume() for prism in prisms)) / volume


def _layers(turned: cq.Shape, frame: cq.Location) -> list[Cut]:
    """Sections half way between the faces that lie across z, each with the distance of these faces.

    Where a hole across cuts the body in two there, the section is one beside it.
    """
    extents = [_extent(face) for face in turned.Faces()]
    ends = [*_extent(turned), *(low for low, high in extents if high - low < 1e-5)]
    found = []
    for low, high in pairwise(sorted({round(height, 6) for height in ends})):
        cuts = list[Cut]()
        for share in (0.5, 0.1, 0.9) if high - low > 1e-4 else ():
            height = low + share * (high - low)
            if faces := _section(turned, height):
                cuts.append(Cut(faces, frame, height, high - low))
            if len(faces) == 1:
                break
        if cuts:
            found.append(min(cuts, key=lambda cut: len(cut.faces)))
    return found


def _depths(layers: Sequence[Cut]) -> list[tuple[float, float]]:
    """Areas of sections, mm^2, from the largest on, and the depths, mm, over which they are so large."""
    areas = np.array([layer.area for layer in layers]).round(3)
    depths = np.array([layer.depth for layer in layers])
    return [(area, float(depths[areas >= area].sum())) for area in np.unique(areas)[::-1].tolist()]


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


def _cut_at(solid: cq.Solid, normal: FloatArray, offset: float) -> tuple[cq.Shape, Cut]:
    """A solid seen across a plane, and its section there; its depth is the solid's extent."""
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
    return turned, Cut(faces, frame, height, high - low)


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

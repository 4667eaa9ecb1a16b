"""Reads the curves of a DXF file. Its layers are the labels."""

import re
from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np

from pinnray.geometry.drawing.formats.closed_loops import Marks
from pinnray.geometry.drawing.formats.drawing import Drawing, label_of
from pinnray.geometry.drawing.formats.dxf_blocks import Walk, sound
from pinnray.geometry.drawing.formats.dxf_file import document_of, dxf_scale
from pinnray.geometry.drawing.formats.pieces import Curve, Piece, arc_through, arcs_along, full_circle, line
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError

WITHOUT_GEOMETRY = re.compile("TEXT|MTEXT|DIMENSION|(MULTI)?LEADER|HATCH|IMAGE|ATTDEF|ATTRIB|POINT")
"""Entities that show or annotate and bound nothing."""


def read_dxf(path: Path, units: str | None = None, tolerance: float | None = None) -> Drawing:
    """The closed curves in the model space of a DXF file.

    Lines, arcs, circles and polylines are exact; ellipses and splines become arcs within 1e-3 mm. Invisible
    entities, layers that are off or frozen, texts, dimensions and hatches are left out. Circles and points of
    the layer `markers` are markers, a point of the layer `contact` is the contact.

    Args:
        path: The file.
        units: Unit of its coordinates; None means the header's, or mm if the header has none.
        tolerance: Largest gap between two ends that is closed, mm; None means 0.001 mm.
    """
    document, repaired = document_of(path)
    scale = dxf_scale(document, path, units)
    marks, pieces, unit = Marks(), list[Piece](), min(scale.length, 1e4)
    for entity, shown in Walk(document):
        layer = label_of(shown)
        with sound(entity, shown):
            if not marks.took(*_mark(entity, unit), layer):
                pieces += _pieces(entity, layer, unit)
    pieces = [piece.scaled(scale.length / unit) for piece in pieces]  # of miles and more, to be refused
    return marks.drawing(pieces, scale, tolerance, f"DXF, {scale}{repaired}", unit=scale.length)


def _mark(entity: Any, unit: float) -> tuple[FloatArray | None, float]:
    """Centre, mm, and diameter, mm, of a circle or a point; None for another entity."""
    if entity.dxftype() == "POINT":
        return _flat(entity.dxf.location) * unit, 0.0
    if entity.dxftype() == "CIRCLE":
        return _flat(_world(entity, entity.dxf.center)) * unit, 2 * entity.dxf.radius * unit
    return None, 0.0


def _pieces(entity: Any, layer: str, unit: float) -> Iterator[Piece]:
    kind = entity.dxftype()
    if kind == "LINE":
        yield line(_flat(entity.dxf.start), _flat(entity.dxf.end), layer).scaled(unit)
    elif kind == "ARC":
        first = np.radians(entity.dxf.start_angle)
        sweep = np.radians((entity.dxf.end_angle - entity.dxf.start_angle) % 360) or 2 * np.pi
        start, middle, end = (
            _flat(_world(entity, entity.dxf.center + entity.dxf.radius * np.array([np.cos(a), np.sin(a), 0])))
            for a in (first, first + sweep / 2, first + sweep)
        )
        if sweep > 2 * np.pi - 1e-9:
            yield from full_circle(0.5 * (start + middle) * unit, entity.dxf.radius * unit, layer)
        else:
            yield arc_through(start, middle, end, layer).scaled(unit)
    elif kind == "CIRCLE":
        centre = _flat(_world(entity, entity.dxf.center))
        yield from full_circle(centre * unit, entity.dxf.radius * unit, layer)
    elif kind == "ELLIPSE":
        first, last = entity.dxf.start_param, entity.dxf.end_param
        last += 2 * np.pi if last <= first else 0.0

        for piece in arcs_along(_flattened(entity.vertices), first, last, layer, unit):
            yield piece.scaled(unit)
    elif kind == "SPLINE":
        spline = entity.construction_tool()
        knots = np.unique(spline.knots())
        inside = knots[(knots >= spline.knots()[spline.order - 1]) & (knots <= spline.knots()[spline.count])]
        for first, last in pairwise(inside.tolist()):
            for piece in arcs_along(_flattened(spline.points), first, last, layer, unit):
                yield piece.scaled(unit)
    elif not WITHOUT_GEOMETRY.fullmatch(kind):
        raise UserError(
            f"cannot read the {kind} on layer {layer!r}; draw the boundary by lines, "
            "arcs, circles, polylines, ellipses and splines, or freeze that layer"
        )


def _world(entity: Any, point: Any) -> Any:
    """A point of an entity's own coordinate system in the drawing's."""
    return entity.ocs().to_wcs(ezdxf.math.Vec3(point))


def _flattened(points: Callable[[FloatArray], Iterable[Any]]) -> Curve:
    """A curve in the plane from one in space."""
    return lambda parameters: np.array([_flat(point) for point in points(parameters)])


def _flat(point: Any) -> FloatArray:
    return np.array([point[0], point[1]], dtype=np.float64)

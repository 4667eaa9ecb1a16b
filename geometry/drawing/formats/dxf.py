"""Reads the curves of a DXF file. Its layers are the labels."""

import re
from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
from ezdxf.lldxf.const import DXFError

from geometry.arrays import FloatArray
from geometry.drawing.formats.chain import Marks
from geometry.drawing.formats.drawing import UNITS, Drawing, label_of
from geometry.drawing.formats.pieces import Curve, Piece, arc_through, arcs_along, full_circle, line
from geometry.errors import UserError

HEADER_UNITS = {1: "in", 4: "mm", 5: "cm", 6: "m", 13: "um"}
"""Units of length by `$INSUNITS` of the header."""

WITHOUT_GEOMETRY = re.compile("TEXT|MTEXT|DIMENSION|(MULTI)?LEADER|HATCH|IMAGE|ATTDEF|ATTRIB|POINT")
"""Entities that show or annotate and bound nothing."""


def read_dxf(path: Path, units: str | None = None) -> Drawing:
    """The closed curves in the model space of a DXF file.

    Lines, arcs, circles and polylines are exact; ellipses and splines become arcs within 1e-3 mm. Layers that
    are off or frozen, texts, dimensions and hatches are left out. Circles and points of the layer `markers`
    are markers, a point of the layer `contact` is the contact.

    Args:
        path: The file.
        units: Unit of its coordinates; None means the header's, or mm if the header has none.
    """
    try:
        document = ezdxf.filemanagement.readfile(path)
    except (OSError, DXFError, UnicodeDecodeError) as error:
        raise UserError(f"it cannot be read as DXF: {str(error).splitlines()[0]}") from None
    except Exception:  # a damaged file can make ezdxf raise anything
        raise UserError("it cannot be read as DXF: it is damaged") from None
    declared = HEADER_UNITS.get(document.units)
    unit = UNITS[units or declared or "mm"]
    marks, pieces = Marks(), list[Piece]()
    for entity in _plain(list(document.modelspace())):
        layer = label_of(_layer(entity))
        entry = document.layers.get(_layer(entity)) if _layer(entity) in document.layers else None
        if layer == "defpoints" or (entry and (entry.is_off() or entry.is_frozen())):
            continue
        if not marks.took(*_mark(entity, unit), layer):
            pieces += _pieces(entity, layer, unit)
    origin = "given" if units else "of the header" if declared else "assumed"
    note = f"DXF, {units or declared or 'mm'} ({origin})"
    return marks.drawing(pieces, unit=unit, note=note)


def _plain(entities: list[Any]) -> Iterator[Any]:
    """The entities, blocks and polylines taken apart."""
    for entity in entities:
        if entity.dxftype() in ("INSERT", "LWPOLYLINE", "POLYLINE"):
            yield from _plain(list(entity.virtual_entities()))
        else:
            yield entity


def _layer(entity: Any) -> str:
    """The layer of an entity; `0`, the format's default, where it has none."""
    try:
        return str(entity.dxf.layer)
    except DXFError:  # of a kind that ezdxf does not know
        return "0"


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
            f"cannot read the {kind} on layer {_layer(entity)!r}; draw the boundary by lines, "
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

"""Reads the curves of a DXF file. Its layers are the labels."""

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
from ezdxf.lldxf.const import DXFError

from geometry.arrays import FloatArray
from geometry.drawing.formats.drawing import UNITS, Drawing, label_of, sha256_of
from geometry.drawing.formats.marks import Marks
from geometry.drawing.formats.pieces import Piece, arc_through, arcs_along, circle, line
from geometry.errors import UserError

HEADER_UNITS = {1: "in", 4: "mm", 5: "cm", 6: "m", 13: "um"}
"""Units of length by `$INSUNITS` of the header."""

WITHOUT_GEOMETRY = {
    "TEXT",
    "MTEXT",
    "DIMENSION",
    "LEADER",
    "MULTILEADER",
    "HATCH",
    "IMAGE",
    "ATTDEF",
    "ATTRIB",
}
"""Entities that show or annotate and bound nothing."""


def read_dxf(path: Path, units: str | None = None) -> Drawing:
    """The closed curves in the model space of a DXF file.

    Lines, arcs, circles and polylines are exact; ellipses and splines become arcs within 1e-3 mm. Layers that
    are off or frozen, texts, dimensions and hatches are left out. Circles and points of the layer `markers`
    are markers, a point of the layer `contact` is the contact.

    Args:
        path: The file.
        units: Unit of its coordinates; None means the header's, or mm if the header has none.

    Raises:
        UserError: If it cannot be read, holds other entities, or its curves do not close.
    """
    digest = sha256_of(path)
    try:
        document = ezdxf.filemanagement.readfile(path)
    except (OSError, DXFError, UnicodeDecodeError) as error:
        raise UserError(f"cannot read {path.name} as DXF: {str(error).splitlines()[0]}") from None
    except Exception:  # a damaged file can make ezdxf raise anything
        raise UserError(f"cannot read {path.name} as DXF: it is damaged") from None
    declared = HEADER_UNITS.get(document.units)
    unit = UNITS[units or declared or "mm"]
    marks = Marks(path.name)
    pieces: list[Piece] = []
    for entity in _plain(list(document.modelspace())):
        layer = label_of(_layer(entity))
        if layer == "defpoints" or _hidden(document, _layer(entity)):
            continue
        if not marks.took(*_mark(entity, unit), layer):
            pieces += _pieces(entity, layer, unit, path.name)
    origin = "given" if units else "of the header" if declared else "assumed"
    note = f"DXF, {units or declared or 'mm'} ({origin})"
    return marks.drawing(pieces, digest, unit=unit, note=note)


def _plain(entities: list[Any]) -> Iterator[Any]:
    """The entities, blocks and polylines taken apart."""
    for entity in entities:
        if entity.dxftype() in ("INSERT", "LWPOLYLINE", "POLYLINE"):
            yield from _plain(list(entity.virtual_entities()))
        else:
            yield entity


def _layer(entity: Any) -> str:
    """The layer of an entity; that of the format where it has none."""
    try:
        return str(entity.dxf.layer)
    except DXFError:  # of a kind that ezdxf does not know
        return "0"


def _hidden(document: Any, layer: str) -> bool:
    if layer not in document.layers:
        return False
    entry = document.layers.get(layer)
    return bool(entry.is_off() or entry.is_frozen())


def _mark(entity: Any, unit: float) -> tuple[FloatArray | None, float]:
    """Centre, mm, and diameter, mm, of a circle or a point; None for another entity."""
    if entity.dxftype() == "POINT":
        return _flat(entity.dxf.location) * unit, 0.0
    if entity.dxftype() == "CIRCLE":
        return _flat(_world(entity, entity.dxf.center)) * unit, 2 * entity.dxf.radius * unit
    return None, 0.0


def _pieces(entity: Any, layer: str, unit: float, file: str) -> Iterator[Piece]:
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
            yield from circle(0.5 * (start + middle) * unit, entity.dxf.radius * unit, layer)
        else:
            yield arc_through(start, middle, end, layer).scaled(unit)
    elif kind == "CIRCLE":
        centre = _flat(_world(entity, entity.dxf.center))
        yield from circle(centre * unit, entity.dxf.radius * unit, layer)
    elif kind == "ELLIPSE":
        first, last = entity.dxf.start_param, entity.dxf.end_param
        last += 2 * np.pi if last <= first else 0.0

        def along(parameters: FloatArray) -> FloatArray:
            return np.array([_flat(point) for point in entity.vertices(parameters)])

        yield from (piece.scaled(unit) for piece in arcs_along(along, first, last, layer, unit))
    elif kind == "SPLINE":
        spline = entity.construction_tool()

        def on_spline(parameters: FloatArray) -> FloatArray:
            return np.array([_flat(point) for point in spline.points(parameters)])

        knots = np.unique(spline.knots())
        inside = knots[(knots >= spline.knots()[spline.order - 1]) & (knots <= spline.knots()[spline.count])]
        for first, last in pairwise(inside.tolist()):
            for piece in arcs_along(on_spline, first, last, layer, unit):
                yield piece.scaled(unit)
    elif kind not in (*WITHOUT_GEOMETRY, "POINT"):
        raise UserError(
            f"{file}: cannot read the {kind} on layer {_layer(entity)!r}; draw the boundary by lines, "
            "arcs, circles, polylines, ellipses and splines, or freeze that layer"
        )


def _world(entity: Any, point: Any) -> Any:
    """A point of an entity's own coordinate system in the drawing's."""
    return entity.ocs().to_wcs(ezdxf.math.Vec3(point))


def _flat(point: Any) -> FloatArray:
    return np.array([point[0], point[1]], dtype=np.float64)

"""Reads the curves of a DXF file. Its layers are the labels."""

import logging
import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
from ezdxf import units as dxf_units
from ezdxf.lldxf.const import DXFError

from pinnray.geometry.drawing.formats.closed_loops import assembled
from pinnray.geometry.drawing.formats.drawing import UNITS, Drawing, Scale, label_of
from pinnray.geometry.drawing.formats.dxf_blocks import Walk, sound
from pinnray.geometry.drawing.formats.pieces import Piece, arcs_along, line
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError

logging.getLogger("ezdxf").addHandler(logging.NullHandler())  # else its notes go to the standard error

HEADER_UNITS = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 9: "mil", 10: "yd", 13: "um", 14: "dm"}
"""Units by `$INSUNITS` of the header."""

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
    document = _document(path)
    scale = _scale(document, path, units)
    pieces, points = list[Piece](), dict[str, list[FloatArray]]()
    for entity, shown in Walk(document):
        layer = label_of(shown)
        with sound(entity, shown):
            if entity.dxftype() == "POINT":
                points.setdefault(layer, []).append(_flat([entity.dxf.location])[0] * scale.length)
            else:
                pieces += _pieces(entity, layer, scale.length)
    return assembled(pieces, points, scale, tolerance, f"DXF, {scale}", unit=scale.length)


def _document(path: Path) -> Any:
    if not path.read_bytes().rstrip().endswith(b"EOF"):
        raise UserError("it cannot be read as DXF: it does not end with EOF; export it again")
    try:
        return ezdxf.filemanagement.readfile(path)
    except (DXFError, UnicodeDecodeError) as error:
        reason = " ".join(str(error).split()).replace(str(path), path.name).rstrip(".")
    except OSError:  # of ezdxf: it is no DXF file
        reason = "it is none"
    except Exception:  # a damaged file can make ezdxf raise anything
        reason = "it is damaged"
    raise UserError(f"it cannot be read as DXF: {reason}; export it again")


def _scale(document: Any, path: Path, units: str | None) -> Scale:
    """Unit of the coordinates: the given one, that of the header, or mm."""
    if units:
        return Scale(UNITS[units], units, "given")
    # ezdxf says metres of a file without a header
    number = document.header.get("$INSUNITS", 0) if b"$INSUNITS" in path.read_bytes() else 0
    if not number:
        return Scale()
    if name := HEADER_UNITS.get(number):
        return Scale(UNITS[name], name, "of the header")
    raise UserError(
        f"the unit of its header ($INSUNITS) is {number}, {dxf_units.unit_name(number)}; "
        'give units = "mm" or another one'
    )


def _pieces(entity: Any, layer: str, unit: float) -> Iterator[Piece]:
    """The lines and arcs of an entity, whose coordinates are in `unit` mm."""
    kind = entity.dxftype()
    if kind == "LINE":
        start, end = unit * _flat([entity.dxf.start, entity.dxf.end])
        yield line(start, end, layer)
        return
    if kind == "CIRCLE":
        points, cuts = entity.vertices, [0.0, 360.0]
    elif kind == "ARC":
        first = entity.dxf.start_angle
        points, cuts = entity.vertices, [first, first + ((entity.dxf.end_angle - first) % 360 or 360)]
    elif kind == "ELLIPSE":
        first, last = entity.dxf.start_param, entity.dxf.end_param
        points, cuts = entity.vertices, [first, last + (2 * np.pi if last <= first else 0)]
    elif kind == "SPLINE":
        spline = entity.construction_tool()
        knots = np.array(spline.knots())
        inside = (knots >= knots[spline.order - 1]) & (knots <= knots[spline.count])
        points, cuts = spline.points, np.unique(knots[inside]).tolist()
    elif WITHOUT_GEOMETRY.fullmatch(kind):
        return
    else:
        raise UserError(
            f"cannot read the {kind} on layer {layer!r}; draw the boundary by lines, "
            "arcs, circles, polylines, ellipses and splines, or freeze that layer"
        )
    for first, last in pairwise(cuts):
        yield from arcs_along(lambda parameters: unit * _flat(points(parameters)), first, last, layer)


def _flat(points: Any) -> FloatArray:
    """Points in space in the plane, shape (n, 2)."""
    return np.array([(point[0], point[1]) for point in points], dtype=np.float64)

"""Reads the curves of an SVG file. The names of its groups and elements are the labels."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import ParseError

import numpy as np
import svgelements

from geometry.arrays import FloatArray
from geometry.drawing.drawing import LABELS, UNITS, Drawing, label_of, sha256_of
from geometry.drawing.marks import Marks
from geometry.drawing.pieces import Piece, arc_through, arcs_along, circle, line
from geometry.errors import UserError

LENGTHS = {**UNITS, "": 25.4 / 96, "px": 25.4 / 96, "pt": 25.4 / 72, "pc": 25.4 / 6}
"""Units of `width` and `height`, mm; a number without one is in pixels."""

INKSCAPE_LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"


def read_svg(path: Path, units: str | None = None) -> Drawing:
    """The closed curves of an SVG file; x as in the file, y upward.

    Lines and circular arcs are exact, other curves become arcs within 1e-3 mm; transformations are applied.
    An element carries its own name or that of its nearest named group, of those that mean something:
    `outline`, `base` or `clamp`, `front`, `contact`, `markers`.

    Args:
        path: The file.
        units: Unit of the user space; None means by `width`, `height` and `viewBox`, or pixels without them.

    Raises:
        UserError: If it cannot be read or its curves do not close.
    """
    digest = sha256_of(path)
    try:
        parsed = svgelements.SVG.parse(str(path), reify=True)
    except (OSError, ParseError, ValueError, UnicodeDecodeError) as error:
        raise UserError(f"cannot read {path.name} as SVG: {error}") from None
    back = ~svgelements.Matrix(parsed.viewbox_transform or "")
    unit, origin = (UNITS[units], "given") if units else (_unit(parsed, path.name), "of width and viewBox")
    marks = Marks(path.name)
    pieces: list[Piece] = []
    for element, label in _shapes(parsed, ""):
        shape = element * back
        shape.reify()
        if not marks.took(*_mark(shape, unit), label):
            pieces += _pieces(svgelements.Path(shape), label, unit)
    return marks.drawing(pieces, digest, note=f"SVG, {unit:.6g} mm in a user unit ({origin})")


def _unit(parsed: Any, file: str) -> float:
    """Length of a user unit, mm.

    Raises:
        UserError: If width and height give two different ones or are no lengths.
    """
    box = parsed.viewbox
    units = []
    for text, extent in (
        (parsed.values.get("width"), box and box.width),
        (parsed.values.get("height"), box and box.height),
    ):
        found = re.fullmatch(r"\s*([0-9.eE+-]+)\s*([a-z]*)\s*", str(text))
        if found and found[2] in LENGTHS:
            units.append(float(found[1]) * LENGTHS[found[2]] / float(extent) if extent else LENGTHS[""])
    if not units:
        return LENGTHS[""]
    if max(units) > min(units) * 1.001:
        raise UserError(
            f"{file}: width and height give {units[0]:.6g} and {units[1]:.6g} mm in a user unit; "
            "make them agree with the viewBox"
        )
    return float(units[0])


def _shapes(group: Any, label: str) -> Iterator[tuple[Any, str]]:
    for element in group:
        name = _name(element) or label
        if isinstance(element, svgelements.Group):
            yield from _shapes(element, name)
        elif isinstance(element, svgelements.Shape) and element.values.get("visibility") != "hidden":
            yield element, name


def _name(element: Any) -> str:
    own = element.values.get("attributes", {})
    for text in (own.get("id"), element.id, own.get(INKSCAPE_LABEL)):
        if text and label_of(text) in (*LABELS, "outline"):
            return label_of(text)
    return ""


def _mark(shape: Any, unit: float) -> tuple[FloatArray | None, float]:
    if (
        not isinstance(shape, svgelements.Circle | svgelements.Ellipse)
        or abs(shape.rx - shape.ry) > 1e-6 * shape.rx
    ):
        return None, 0.0
    return _flat(shape.implicit_center, unit), float(shape.implicit_rx + shape.implicit_ry) * unit


def _pieces(path: Any, label: str, unit: float) -> Iterator[Piece]:
    for segment in path:
        if isinstance(segment, svgelements.Move) or segment.start is None or segment.end is None:
            continue
        start, end = _flat(segment.start, unit), _flat(segment.end, unit)
        if isinstance(segment, svgelements.Line | svgelements.Close):
            yield line(start, end, label)
        elif isinstance(segment, svgelements.Arc) and abs(segment.rx - segment.ry) <= 1e-9 * segment.rx:
            if abs(segment.sweep) > 2 * np.pi - 1e-9:
                yield from circle(_flat(segment.center, unit), float(segment.rx) * unit, label)
            else:
                yield arc_through(start, _flat(segment.point(0.5), unit), end, label)
        else:
            yield from arcs_along(_Along(segment, unit), 0.0, 1.0, label)


class _Along:
    """Points of a segment, mm."""

    def __init__(self, segment: Any, unit: float) -> None:
        self._segment, self._unit = segment, unit

    def __call__(self, parameters: FloatArray) -> FloatArray:
        return np.array([_flat(self._segment.point(float(t)), self._unit) for t in parameters])


def _flat(point: Any, unit: float) -> FloatArray:
    return np.array([point.x, -point.y], dtype=np.float64) * unit

"""Reads the curves of an SVG file. The names of its groups and elements are the labels."""

from collections.abc import Iterable, Iterator
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import svgelements

from pinnray.geometry.drawing.formats.closed_loops import assembled
from pinnray.geometry.drawing.formats.drawing import LABELS, Drawing, label_of
from pinnray.geometry.drawing.formats.pieces import Piece, arcs_along, line
from pinnray.geometry.drawing.formats.svg_tree import drawn, svg_scale, tag_of
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError

ASSUMED = '(assumed: 96 pixels to an inch; give units, such as "pt" for 72)'
"""Said of a file whose width and height have no unit."""

UNSEEN = ("hidden", "collapse")
"""Values of `visibility` of what does not show."""


def read_svg(path: Path, units: str | None = None, tolerance: float | None = None) -> Drawing:
    """The closed curves of an SVG file; x as in the file, y upward.

    Lines and circular arcs are exact, other curves become arcs within 1e-3 mm; transformations are applied.
    An element carries its own name or, without one, its nearest group's. These names mean something:
    `outline`, `base` or `clamp`, `front`, `contact`, `markers`.

    Args:
        path: The file.
        units: Unit of the user space; None means by `width`, `height` and `viewBox`, or pixels without them.
        tolerance: Largest gap between two ends that is closed, mm; None means 0.001 mm.
    """
    try:
        root = ET.parse(path).getroot()
        if (tag := tag_of(root)) != "svg":
            raise UserError(f"its outermost element is {tag or root.tag}, not svg")
        scale = svg_scale(root, units)
        parsed = svgelements.SVG.parse(BytesIO(ET.tostring(drawn(root))), reify=False)
        upward = svgelements.Matrix(scale.length, 0, 0, -scale.length, 0, 0)
        place = ~svgelements.Matrix(parsed.viewbox_transform or "") * upward
        pieces = [
            piece
            for element, label in _shapes(parsed, "")
            for piece in _pieces(element.segments(transformed=False), label, element.transform * place)
        ]
    except (ET.ParseError, UserError) as error:
        reason = str(error)
    except RecursionError:
        reason = "an element contains itself, or is nested too deeply"
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):  # of svgelements
        reason = "the value of an attribute is missing or no number"
    else:
        said = {"given": " (given)", "assumed": f" {ASSUMED}"}.get(scale.origin, "")
        return assembled(pieces, {}, scale, tolerance, f"SVG, {scale.length:.6g} mm in a user unit{said}")
    raise UserError(f"it cannot be read as SVG: {reason}")


def _shapes(group: Any, label: str) -> Iterator[tuple[Any, str]]:
    for element in group:
        name = _name(element) or label
        if isinstance(element, svgelements.Group | svgelements.Use):
            yield from _shapes(element, name)
        elif isinstance(element, svgelements.Shape) and element.values.get("visibility") not in UNSEEN:
            yield element, name


def _name(element: Any) -> str:
    own = element.values.get("attributes", {})
    inkscape = own.get("{http://www.inkscape.org/namespaces/inkscape}label")
    for text in (own.get("id"), element.id, inkscape):
        if text and label_of(text) in (*LABELS, "outline"):
            return label_of(text)
    return ""


def _pieces(segments: Iterable[Any], label: str, matrix: Any) -> Iterator[Piece]:
    """Lines and arcs of segments, whose own coordinates a matrix takes into the drawing's."""
    for segment in segments:
        if isinstance(segment, svgelements.Move) or segment.start is None or segment.end is None:
            continue
        if isinstance(segment, svgelements.Line | svgelements.Close):
            start, end = _placed(matrix, [segment.start, segment.end])
            yield line(start, end, label)
        else:
            yield from arcs_along(partial(_along, segment, matrix), 0.0, 1.0, label)


def _along(segment: Any, matrix: Any, parameters: FloatArray) -> FloatArray:
    return _placed(matrix, [segment.point(float(each)) for each in parameters])


def _placed(matrix: Any, points: Iterable[Any]) -> FloatArray:
    return np.array([matrix.point_in_matrix_space(point) for point in points], dtype=np.float64)

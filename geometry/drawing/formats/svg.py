"""Reads the curves of an SVG file. The names of its groups and elements are the labels."""

from collections.abc import Callable, Iterable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import svgelements

from pinnray.geometry.drawing.formats.closed_loops import assembled
from pinnray.geometry.drawing.formats.drawing import LABELS, Drawing, label_of
from pinnray.geometry.drawing.formats.pieces import Piece, arcs_along, line
from pinnray.geometry.drawing.formats.svg_tree import NAMESPACE, drawn, svg_scale, tag_of
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
    tree = None
    try:
        root = ET.parse(path).getroot()
        if (tag := tag_of(root)) != "svg":
            raise UserError(f"its outermost element is {tag or root.tag}, not svg")
        scale = svg_scale(root, units)
        tree = drawn(root)
        parsed = svgelements.SVG.parse(BytesIO(ET.tostring(tree)), reify=False)
        back = ~svgelements.Matrix(parsed.viewbox_transform or "")
    except (OSError, ET.ParseError, ValueError, UnicodeDecodeError) as error:
        raise UserError(f"it cannot be read as SVG: {error or _unsound(tree)}") from None
    except RecursionError:
        raise UserError("it cannot be read as SVG: it is nested too deeply") from None
    except (ArithmeticError, AttributeError, LookupError, TypeError):  # of svgelements, at what is no SVG
        raise UserError(f"it cannot be read as SVG: {_unsound(tree)}") from None
    pieces = list[Piece]()
    for element, label in _shapes(parsed, ""):
        place = _Transformation(element.transform * back, scale.length)
        if not place.is_finite:
            raise UserError(f"the transformation of {_described(element)} is not finite")
        try:
            pieces += _pieces(element.segments(transformed=False), label, place)
        except TypeError:  # svgelements reads a coordinate that is no number as None
            raise UserError(f"a coordinate of {_described(element)} is no number") from None
    said = {"given": " (given)", "assumed": f" {ASSUMED}"}.get(scale.origin, "")
    return assembled(pieces, [], scale, tolerance, f"SVG, {scale.length:.6g} mm in a user unit{said}")


def _unsound(tree: ET.Element | None) -> str:
    """The attribute that svgelements cannot read, in words, as far as it is a path's."""
    for path in () if tree is None else tree.iter(f"{NAMESPACE}path"):
        try:
            svgelements.Path(path.get("d", ""))
        except Exception:  # of svgelements
            name = repr(path.get("id")) if path.get("id") else "a path without an id"
            return f"the attribute d of {name} has no sound value"
    return "an attribute has no sound value"


def _described(element: Any) -> str:
    if element.id:
        return f"the element {element.id!r}"
    kind = type(element).__name__.lower()
    return f"{'an' if kind[0] in 'aeiou' else 'a'} {kind} without an id"


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


class _Transformation:
    """From an element's own coordinates into the drawing's, mm, y upward."""

    def __init__(self, matrix: Any, unit: float) -> None:
        flip = np.array([[unit, 0.0], [0.0, -unit]])
        self._matrix = flip @ np.array([[matrix.a, matrix.c], [matrix.b, matrix.d]])
        self._shift = flip @ np.array([matrix.e, matrix.f])

    @property
    def is_finite(self) -> bool:
        """Whether it has neither an infinite number nor none."""
        return bool(np.isfinite(self._matrix).all() and np.isfinite(self._shift).all())

    def __call__(self, point: Any) -> FloatArray:
        """A point in the drawing, shape (2,), mm."""
        return np.asarray(self._matrix @ [float(point[0]), float(point[1])] + self._shift)

    def along(self, segment: Any) -> Callable[[FloatArray], FloatArray]:
        """Points of a segment at parameters from 0 to 1."""
        return lambda parameters: np.array([self(segment.point(float(t))) for t in parameters])


def _pieces(segments: Iterable[Any], label: str, place: _Transformation) -> Iterator[Piece]:
    for segment in segments:
        if isinstance(segment, svgelements.Move) or segment.start is None or segment.end is None:
            continue
        if isinstance(segment, svgelements.Line | svgelements.Close):
            yield line(place(segment.start), place(segment.end), label)
        else:
            yield from arcs_along(place.along(segment), 0.0, 1.0, label)

"""Reads the curves of an SVG file. The names of its groups and elements are the labels."""

import re
from collections.abc import Callable, Iterable, Iterator
from math import inf
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import svgelements

from geometry.arrays import FloatArray
from geometry.drawing.formats.chain import Marks
from geometry.drawing.formats.drawing import LABELS, UNITS, Drawing, label_of
from geometry.drawing.formats.pieces import Piece, arc_through, arcs_along, full_circle, line
from geometry.errors import UserError

LENGTHS = {**UNITS, "": 25.4 / 96, "px": 25.4 / 96, "pt": 25.4 / 72, "pc": 25.4 / 6}
"""Units of `width` and `height`, mm; a number without one is in pixels."""


def read_svg(path: Path, units: str | None = None) -> Drawing:
    """The closed curves of an SVG file; x as in the file, y upward.

    Lines and circular arcs are exact, other curves become arcs within 1e-3 mm; transformations are applied.
    An element carries its own name or, without one, its nearest group's. These names mean something:
    `outline`, `base` or `clamp`, `front`, `contact`, `markers`.

    Args:
        path: The file.
        units: Unit of the user space; None means by `width`, `height` and `viewBox`, or pixels without them.
    """
    try:
        root = ET.parse(path).getroot()
        _check_copies(root)
        parsed = svgelements.SVG.parse(str(path), reify=False)
    except (OSError, ET.ParseError, ValueError, UnicodeDecodeError) as error:
        raise UserError(f"it cannot be read as SVG: {error}") from None
    except RecursionError:
        raise UserError("it cannot be read as SVG: it is nested too deeply") from None
    except (ArithmeticError, AttributeError, LookupError, TypeError):  # of svgelements, at what is no SVG
        raise UserError("it cannot be read as SVG: an attribute has no sound value") from None
    if not isinstance(parsed, svgelements.SVG):
        raise UserError(f"it cannot be read as SVG: its outermost element is {_tag(root)}, not svg")
    _check_view_box(parsed)
    try:
        back = ~svgelements.Matrix(parsed.viewbox_transform or "")
    except ZeroDivisionError:
        raise UserError("its width or height is zero, or no length") from None
    unit = UNITS[units] if units else _unit(parsed)
    marks, pieces = Marks(), list[Piece]()
    for element, label in _shapes(parsed, ""):
        place = _Transformation(element.transform * back, unit)
        if not place.is_finite:
            raise UserError(f"the transformation of {_described(element)} is not finite")
        try:
            if not marks.took(*_mark(element, place), label):
                pieces += _pieces(element.segments(transformed=False), label, place)
        except TypeError:  # svgelements reads a coordinate that is no number as None
            raise UserError(f"a coordinate of {_described(element)} is no number") from None
    return marks.drawing(pieces, note=f"SVG, {unit:.6g} mm in a user unit{' (given)' if units else ''}")


def _check_copies(root: ET.Element) -> None:
    """Refuse elements that contain themselves, and copies of copies whose number grows without limit."""
    by_id = {element.get("id"): element for element in root.iter()}
    sizes: dict[ET.Element, float] = {}

    def size(element: ET.Element) -> float:
        if element not in sizes:
            sizes[element] = inf  # while it is open, that is, if it contains itself
            # svgelements, too, takes any sign in place of the link's #
            link = element.get("href", element.get("{http://www.w3.org/1999/xlink}href", ""))[1:]
            copied = by_id.get(link) if _tag(element) == "use" else None
            sizes[element] = 1 + sum(map(size, element)) + (0 if copied is None else size(copied))
        return sizes[element]

    if (count := size(root)) > 100_000:  # a copy counts as often as it is made
        what = "an element contains itself" if count == inf else f"its copies make {count:.0f} elements"
        raise UserError(f"{what}; draw each curve once")


def _tag(element: ET.Element) -> str:
    """Name of an element without its namespace; empty for a comment."""
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""


def _check_view_box(parsed: Any) -> None:
    """Raise a `UserError` for a viewBox that is not four numbers, which the parser would pass over."""
    if (given := parsed.values.get("viewBox")) is None:
        return
    try:
        *_, width, height = numbers = [float(text) for text in re.split(r"[\s,]+", str(given).strip())]
    except ValueError:
        numbers, width, height = [], 0.0, 0.0
    if len(numbers) != 4 or not (0 < width < inf and 0 < height < inf):
        raise UserError(
            f"viewBox = {str(given)!r} is not four numbers with width and height, such as 0 0 60 10"
        )


def _described(element: Any) -> str:
    if element.id:
        return f"the element {element.id!r}"
    kind = type(element).__name__.lower()
    return f"{'an' if kind[0] in 'aeiou' else 'a'} {kind} without an id"


def _unit(parsed: Any) -> float:
    """Length of a user unit, mm; refused if width and height give two different ones or are no lengths."""
    box = parsed.viewbox
    units = []
    for text, extent in (
        (parsed.values.get("width"), box and box.width),
        (parsed.values.get("height"), box and box.height),
    ):
        found = re.fullmatch(r"\s*([0-9.eE+-]+)\s*([a-z]*)\s*", str(text))
        if found and found[2] in LENGTHS:
            try:
                length = float(found[1])
            except ValueError:
                length = 0.0
            if not 0 < length < inf:
                raise UserError(f"{text!r} is no width or height; write for instance 60mm")
            units.append(length * LENGTHS[found[2]] / float(extent) if extent else LENGTHS[""])
    if not units:
        return LENGTHS[""]
    if max(units) > min(units) * 1.001:
        raise UserError(
            f"width and height give {units[0]:.6g} and {units[1]:.6g} mm in a user unit; "
            "make them agree with the viewBox"
        )
    return float(units[0])


def _shapes(group: Any, label: str) -> Iterator[tuple[Any, str]]:
    for element in group:
        name = _name(element) or label
        if isinstance(element, svgelements.Group | svgelements.Use):
            yield from _shapes(element, name)
        elif isinstance(element, svgelements.Shape) and element.values.get("visibility") != "hidden":
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

    @property
    def scale(self) -> float | None:
        """Length of a unit, mm; None if circles do not stay circles."""
        low, high = sorted(np.linalg.svd(self._matrix, compute_uv=False))
        return float(high) if high - low <= 1e-9 * high else None

    def __call__(self, point: Any) -> FloatArray:
        """A point in the drawing, shape (2,), mm."""
        return np.asarray(self._matrix @ [float(point[0]), float(point[1])] + self._shift)

    def along(self, segment: Any) -> Callable[[FloatArray], FloatArray]:
        """Points of a segment at parameters from 0 to 1."""
        return lambda parameters: np.array([self(segment.point(float(t))) for t in parameters])


def _mark(shape: Any, place: _Transformation) -> tuple[FloatArray | None, float]:
    """Centre and diameter of a circle, mm; None for another shape."""
    if not isinstance(shape, svgelements.Circle | svgelements.Ellipse) or not place.scale:
        return None, 0.0
    if abs(shape.rx - shape.ry) > 1e-9 * shape.rx:
        return None, 0.0
    return place((shape.cx, shape.cy)), 2 * float(shape.rx) * place.scale


def _pieces(segments: Iterable[Any], label: str, place: _Transformation) -> Iterator[Piece]:
    for segment in segments:
        if isinstance(segment, svgelements.Move) or segment.start is None or segment.end is None:
            continue
        start, end = place(segment.start), place(segment.end)
        round_arc = isinstance(segment, svgelements.Arc) and abs(segment.rx - segment.ry) <= 1e-9 * segment.rx
        if isinstance(segment, svgelements.Line | svgelements.Close):
            yield line(start, end, label)
        elif not (round_arc and place.scale):
            yield from arcs_along(place.along(segment), 0.0, 1.0, label)
        elif abs(segment.sweep) > 2 * np.pi - 1e-9:
            yield from full_circle(place(segment.center), float(segment.rx) * place.scale, label)
        else:
            yield arc_through(start, place(segment.point(0.5)), end, label)

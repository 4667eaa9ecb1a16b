"""Prepares the elements of an SVG file: what is drawn, in which unit, with symbols where they are used."""

import re
from collections.abc import Iterator
from math import inf, isfinite
from typing import NamedTuple
from xml.etree import ElementTree as ET

import svgelements

from pinnray.geometry.drawing.formats.drawing import UNITS, Scale
from pinnray.runtime.errors import UserError

NAMESPACE = "{http://www.w3.org/2000/svg}"
LINK = "{http://www.w3.org/1999/xlink}href"

LENGTHS = {**{name: UNITS[name] for name in ("mm", "cm", "in", "pt", "px")}, "pc": 25.4 / 6, "q": 0.25}
LENGTHS |= {"": UNITS["px"], **{name: UNITS[name] for name in ("um", "m")}}
"""Units of `width` and `height`, mm; a number without one is in pixels."""

LENGTH = re.compile(r"([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)\s*([a-zA-Z%]*)")
"""A number with or without a unit."""

SHAPES = {"path", "rect", "circle", "ellipse", "line", "polyline", "polygon", "use", "image", "text"}
LENGTHY = {"x", "y", "width", "height", "cx", "cy", "r", "rx", "ry", "x1", "y1", "x2", "y2"}
GROUPS = {"svg", "g", "a", "switch", "defs", "style"}
UNDRAWN = {"mask", "marker", "symbol", "clipPath", "pattern"}
"""Elements whose content is not drawn where it stands, but may be used elsewhere."""


class ViewBox(NamedTuple):
    """Attribute `viewBox`."""

    x: float
    y: float
    width: float
    height: float


def drawn(root: ET.Element) -> ET.Element:
    """A copy of the tree without what is not drawn, with symbols and inner `svg` elements as groups.

    Raises:
        UserError: If an element contains itself, copies grow without limit, or a size is no length.
    """
    _check_copies(root)
    box = view_box(root)
    sizes = {"width": box.width, "height": box.height} if box else {}
    kept = {name: text for name, text in root.attrib.items() if name not in ("width", "height")}
    copy = ET.Element(root.tag, kept | {name: repr(size) for name, size in sizes.items()})
    copy.extend(list(_Copies(root, sizes).of(root)))
    return copy


def tag_of(element: ET.Element) -> str:
    """Name of an element without SVG's namespace; empty for a comment and another namespace."""
    if not isinstance(element.tag, str):
        return ""
    name = element.tag.removeprefix(NAMESPACE)
    return "" if name.startswith("{") else name


def view_box(element: ET.Element) -> ViewBox | None:
    """The viewBox of an element; refused if it is not four numbers, which svgelements would pass over."""
    if (given := element.get("viewBox")) is None:
        return None
    try:
        numbers = [float(text) for text in re.split(r"[\s,]+", given.strip())]
    except ValueError:
        numbers = []
    if len(numbers) != 4 or not (0 < numbers[2] < inf and 0 < numbers[3] < inf):
        raise UserError(f"viewBox = {given!r} is not four numbers with width and height, such as 0 0 60 10")
    return ViewBox(*numbers)


def svg_scale(root: ET.Element, units: str | None) -> Scale:
    """Length of a user unit by `width`, `height` and `viewBox`, or the given one.

    Raises:
        UserError: If width and height give two different ones, or one of them is no length of paper.
    """
    if units:
        return Scale(UNITS[units], units, "given")
    box, found, guessed = view_box(root), list[float](), True
    for name in ("width", "height"):
        if (text := root.get(name)) is None:
            continue
        parts = LENGTH.fullmatch(text.strip())
        if not parts or parts[2].lower() not in LENGTHS:
            raise UserError(
                f'{name} = {text!r} is no length of paper; write such as 60mm, or give units = "mm"'
            )
        length = float(parts[1]) * LENGTHS[parts[2].lower()]
        if not 0 < length < inf:
            raise UserError(f"{text!r} is no width or height; write for instance 60mm")
        guessed &= parts[2].lower() in ("", "px")
        found.append(length / getattr(box, name) if box else LENGTHS[""])
    if found and max(found) > min(found) * 1.001:
        raise UserError(
            f"width and height give {found[0]:.6g} and {found[1]:.6g} mm in a user unit; "
            "make them agree with the viewBox"
        )
    return Scale(
        found[0] if found else LENGTHS[""], "user units", "assumed" if guessed or not box else "of the file"
    )


def _check_copies(root: ET.Element) -> None:
    """Refuse elements that contain themselves, and copies of copies whose number grows without limit."""
    by_id = {element.get("id"): element for element in root.iter()}
    sizes: dict[ET.Element, float] = {}

    def size(element: ET.Element) -> float:
        if element not in sizes:
            sizes[element] = inf  # while it is open, that is, if it contains itself
            copied = by_id.get(_link(element)) if tag_of(element) == "use" else None
            sizes[element] = 1 + sum(map(size, element)) + (0 if copied is None else size(copied))
        return sizes[element]

    if (count := size(root)) > 100_000:  # a copy counts as often as it is made
        what = "an element contains itself" if count == inf else f"its copies make {count:.0f} elements"
        raise UserError(f"{what}; draw each curve once")


def _link(element: ET.Element) -> str:
    """Id of the element that a `use` shows; svgelements, too, takes any sign in place of the #."""
    return element.get("href", element.get(LINK, ""))[1:]


class _Copies:
    """Copies of elements as they are drawn."""

    def __init__(self, root: ET.Element, sizes: dict[str, float]) -> None:
        self._by_id = {element.get("id"): element for element in root.iter()}
        self._sizes = sizes  # of the user space, to which percentages refer

    def of(self, parent: ET.Element) -> Iterator[ET.Element]:
        """Copies of an element's children."""
        for child in parent:
            tag = tag_of(child)
            target = self._by_id.get(_link(child)) if tag == "use" else None
            if tag == "path" and child.get("d", "").strip() in ("", "none"):
                continue  # it is empty
            if tag == "use" and target is not None and tag_of(target) in ("symbol", "svg"):
                yield self._group(child, target, f"translate({child.get('x', '0')},{child.get('y', '0')})")
            elif tag == "svg":
                yield self._group(child, child, "")
            elif tag == "switch":
                yield self._copy(child, "g", list(self.of(child))[:1])
            elif tag in UNDRAWN:
                yield self._copy(child, "defs", list(self.of(child)))
            elif tag in SHAPES | GROUPS and not child.get("requiredExtensions"):
                yield self._copy(child, tag, list(self.of(child)))

    @staticmethod
    def _copy(element: ET.Element, tag: str, children: list[ET.Element]) -> ET.Element:
        copy = ET.Element(NAMESPACE + tag, element.attrib)
        copy.text, copy.tail = element.text, element.tail
        copy.extend(children)
        return copy

    def _group(self, shown: ET.Element, source: ET.Element, shift: str) -> ET.Element:
        """A group in place of an inner `svg`, or of a `use` of one or of a symbol."""
        own = {name: self._length(source, name) for name in ("x", "y", "width", "height")}
        sizes = {name: self._length(shown, name) for name in ("width", "height")}
        place = own | {name: size for name, size in sizes.items() if size is not None}
        moves = [shown.get("transform", ""), shift]
        x, y = (0.0 if place[name] is None else place[name] for name in ("x", "y"))
        box = view_box(source)
        if box is None:
            moves.append(f"translate({x},{y})")
        else:
            wide, high = (
                place[name] or self._sizes.get(name) or getattr(box, name) for name in ("width", "height")
            )
            aspect = source.get("preserveAspectRatio")
            moves.append(svgelements.Viewbox.viewbox_transform(x, y, wide, high, *box, aspect))
        self._check_shares(source, box is not None or any(place[name] for name in ("width", "height")))
        skipped = {"x", "y", "width", "height", "viewBox", "preserveAspectRatio", "href", LINK, "transform"}
        kept = {name: text for name, text in shown.attrib.items() if name not in skipped}
        group = ET.Element(NAMESPACE + "g", kept | {"transform": " ".join(filter(None, moves))})
        group.extend(list(self.of(source)))
        return group

    @staticmethod
    def _check_shares(source: ET.Element, has_size: bool) -> None:
        """Refuse percentages of a size that is not the whole drawing's, which svgelements takes for it."""
        for element in (each for each in source.iter() if has_size and each is not source):
            for name, text in element.attrib.items():
                if name in LENGTHY and text.strip().endswith("%"):
                    raise UserError(f"{name} = {text!r} within an inner {tag_of(source)}; write a number")

    def _length(self, element: ET.Element, name: str) -> float | None:
        """A length of the user space; None where there is none."""
        text = element.get(name, "").strip()
        if not text or text == "auto":
            return None
        whole = self._sizes.get({"x": "width", "y": "height"}.get(name, name))
        parts = LENGTH.fullmatch(text)
        scale = whole / 100 if parts and parts[2] == "%" and whole else None
        if parts and parts[2].lower() in LENGTHS:
            scale = LENGTHS[parts[2].lower()] / LENGTHS[""]
        length = float(parts[1]) * scale if parts and scale is not None else inf
        if not isfinite(length):
            raise UserError(f"{name} = {text!r} of an inner {tag_of(element)} is no length; write a number")
        return length

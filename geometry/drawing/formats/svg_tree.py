"""Prepares the elements of an SVG file: what is drawn, and in which unit."""

import re
from collections.abc import Iterable, Iterator, Mapping
from itertools import count
from math import inf
from xml.etree import ElementTree as ET

from pinnray.geometry.drawing.formats.drawing import UNITS, Scale
from pinnray.runtime.errors import UserError

NAMESPACE = "{http://www.w3.org/2000/svg}"
LINK = "{http://www.w3.org/1999/xlink}href"

LENGTHS = {**{name: UNITS[name] for name in ("mm", "cm", "in", "pt", "px")}, "pc": 25.4 / 6, "q": 0.25}
LENGTHS |= {"": UNITS["px"], **{name: UNITS[name] for name in ("um", "m")}}
"""Units of `width` and `height`, mm; a number without one is in pixels."""

LENGTH = re.compile(r"([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)\s*([a-zA-Z%]*)")
"""A number with or without a unit."""

SHAPES = {"path", "rect", "circle", "ellipse", "line", "polyline", "polygon", "image", "text"}
GROUPS = {"g", "a", "use", "switch", "defs", "style"}
MOST = 100_000
"""Largest number of elements with all copies."""


def drawn(root: ET.Element) -> ET.Element:
    """A copy of the tree without what is not drawn, with the elements that a `use` shows in its place.

    Raises:
        UserError: If copies grow without limit, or a symbol or an inner `svg` is shown.
    """
    box = view_box(root)
    copy = ET.Element(root.tag, root.attrib)
    for name in ("width", "height"):
        copy.attrib.pop(name, None)
        if box:
            copy.set(name, repr(box[name]))
    copy.extend(list(_copies(root, {element.get("id"): element for element in root.iter()}, count())))
    return copy


def tag_of(element: ET.Element) -> str:
    """Name of an element without SVG's namespace; empty for a comment and another namespace."""
    if not isinstance(element.tag, str):
        return ""
    name = element.tag.removeprefix(NAMESPACE)
    return "" if name.startswith("{") else name


def view_box(element: ET.Element) -> dict[str, float] | None:
    """Width and height of an element's viewBox.

    Raises:
        UserError: If it is not four numbers, which svgelements would pass over.
    """
    if (given := element.get("viewBox")) is None:
        return None
    try:
        numbers = [float(text) for text in re.split(r"[\s,]+", given.strip())]
    except ValueError:
        numbers = []
    if len(numbers) != 4 or not (0 < numbers[2] < inf and 0 < numbers[3] < inf):
        raise UserError(f"viewBox = {given!r} is not four numbers with width and height, such as 0 0 60 10")
    return {"width": numbers[2], "height": numbers[3]}


def svg_scale(root: ET.Element, units: str | None) -> Scale:
    """Length of a user unit by `width`, `height` and `viewBox`, or the given one; the smaller if both differ.

    Raises:
        UserError: If one of them is no length of paper.
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
        found.append(length / box[name] if box else LENGTHS[""])
    return Scale(
        min(found) if found else LENGTHS[""], "user units", "assumed" if guessed or not box else "of the file"
    )


def _copies(
    elements: Iterable[ET.Element], by_id: Mapping[str | None, ET.Element], counter: Iterator[int]
) -> Iterator[ET.Element]:
    """Copies of elements as they are drawn."""
    for element in elements:
        if next(counter) > MOST:
            raise UserError(f"its copies make more than {MOST} elements; draw each curve once")
        tag, kept, children = tag_of(element), dict(element.attrib), list(element)
        if tag == "use":
            shown = by_id.get(element.get("href", element.get(LINK, "")).removeprefix("#"))
            children = [] if shown is None else [shown]
            x, y = kept.pop("x", 0), kept.pop("y", 0)
            kept["transform"] = f"{kept.get('transform', '')} translate({x},{y})"
        if tag == "svg" or (tag == "use" and any(tag_of(child) == "symbol" for child in children)):
            what = "a symbol" if tag == "use" else "an inner svg"
            raise UserError(f"it shows {what}, which is not read; make it a group")
        if tag not in SHAPES | GROUPS or element.get("requiredExtensions"):
            continue
        if tag == "path" and element.get("d", "").strip() in ("", "none"):
            continue  # it is empty
        copies = list(_copies(children, by_id, counter))
        copy = ET.Element(NAMESPACE + ("g" if tag in ("use", "switch") else tag), kept)
        copy.text = element.text
        copy.extend(copies[:1] if tag == "switch" else copies)
        yield copy

"""Prepares the elements of an SVG file: what is drawn, and in which unit."""

import re
from collections.abc import Iterator, Mapping
from math import inf
from typing import NamedTuple
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

SHAPES = {"path", "rect", "circle", "ellipse", "line", "polyline", "polygon", "use", "image", "text"}
GROUPS = {"g", "a", "defs", "style"}
UNDRAWN = {"mask", "marker", "symbol", "clipPath", "pattern"}
"""Elements whose content is not drawn where it stands, but may be used elsewhere."""


class ViewBox(NamedTuple):
    """Attribute `viewBox`."""

    x: float
    y: float
    width: float
    height: float


def drawn(root: ET.Element) -> ET.Element:
    """A copy of the tree without what is not drawn.

    Raises:
        UserError: If an element contains itself, copies grow without limit, or a symbol or an inner `svg` is
            shown, which svgelements would place without its size.
    """
    by_id = {element.get("id"): element for element in root.iter()}
    _check_copies(root, by_id)
    box = view_box(root)
    copy = ET.Element(root.tag, root.attrib)
    for name in ("width", "height"):
        copy.attrib.pop(name, None)
        if box:
            copy.set(name, repr(getattr(box, name)))
    copy.extend(list(_copies(root, by_id)))
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


def _check_copies(root: ET.Element, by_id: Mapping[str | None, ET.Element]) -> None:
    """Refuse elements that contain themselves, and copies of copies whose number grows without limit."""
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


def _copies(parent: ET.Element, by_id: Mapping[str | None, ET.Element]) -> Iterator[ET.Element]:
    """Copies of an element's children as they are drawn."""
    for child in parent:
        tag = tag_of(child)
        target = by_id.get(_link(child)) if tag == "use" else None
        shown = tag if target is None else tag_of(target)
        if shown == "svg" or (tag == "use" and shown == "symbol"):
            raise UserError(
                f"it shows {'a symbol' if shown == 'symbol' else 'an inner svg'}; put it in a group"
            )
        if tag == "path" and child.get("d", "").strip() in ("", "none"):
            continue  # it is empty
        if tag == "switch":
            tag, children = "g", list(_copies(child, by_id))[:1]
        elif tag in UNDRAWN:
            tag, children = "defs", list(_copies(child, by_id))
        elif tag in SHAPES | GROUPS and not child.get("requiredExtensions"):
            children = list(_copies(child, by_id))
        else:
            continue
        copy = ET.Element(NAMESPACE + tag, child.attrib)
        copy.text, copy.tail = child.text, child.tail
        copy.extend(children)
        yield copy

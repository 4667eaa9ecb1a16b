"""Clamp, contact and markers of a drawn finger: a small TOML file beside the drawing, or lines of one."""

from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, model_validator

from geometry.errors import UserError
from geometry.finger.parameters import CheckedModel, bounded
from geometry.text_files import parse_toml, read_toml

Point = tuple[float, float]
"""X and y in the file's coordinates."""


class Description(CheckedModel):
    """Clamp, contact and markers of a drawing, in the file's coordinates; what is missing is proposed.

    Lengths are in the file's unit, as the coordinates are.
    """

    name: str | None = Field(
        default=None,
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$",
        description="What files and reports call the finger; none means the file's name",
    )
    units: Literal["um", "mm", "cm", "m", "in"] | None = Field(
        default=None, description="Unit of the file's coordinates; none means the file's own, or mm"
    )
    plane: str | None = Field(default=None, description="Plane in which a solid is cut, such as z = 6")
    clamp: tuple[tuple[Point, Point], ...] | str | None = Field(
        default=None,
        description="Two points of the outline, or several such pairs: the boundary between them, the "
        "shorter way, is clamped; or a label of the file",
    )
    contact: Point | str | None = Field(
        default=None, description="A point of the outline, where the indenter touches; or a label of the file"
    )
    contact_width: float | None = bounded(
        None, 1e-6, 2000, "", "", "Length of front face that the indenter touches, in the file's unit"
    )
    markers: tuple[Point, ...] | int | str | None = Field(
        default=None, description="Centres of the markers, or their number, or a label of the file"
    )
    marker_diameter: float | None = bounded(
        None, 1e-6, 2000, "", "", "Diameter of a marker, in the file's unit"
    )
    marker_height: float | None = bounded(
        None, 1e-6, 2000, "", "", "How deep a marker is inlaid, in the file's unit"
    )
    depth: float | None = bounded(None, 1e-6, 2000, "", "", "Depth of the extrusion, in the file's unit")

    @model_validator(mode="before")
    @classmethod
    def _read_points(cls, values: Any) -> Any:
        if not isinstance(values, Mapping):
            return values
        read = dict(values)
        for key, meaning in _READ.items():
            if read.get(key) is not None:
                read[key] = meaning(read[key])
        return read


def description_beside(drawing: Path) -> Path | None:
    """The TOML file of the drawing's name beside it, or None."""
    path = drawing.with_suffix(".toml")
    return path if path.is_file() and path != drawing else None


def load_description(path: Path | None, lines: Sequence[str] = ()) -> Description:
    """A description from a TOML file, with values changed by lines such as `contact = [35, 0]`.

    Raises:
        UserError: If the file or a line cannot be read, or a value is wrong.
    """
    values: dict[str, Any] = {}
    if path is not None:
        values = read_toml(path, "description")
    for text in lines:
        try:
            values |= parse_toml(text)
        except ValueError:
            raise UserError(
                f'cannot read {text!r}; write TOML, such as contact = [35, 0] or clamp = "base"'
            ) from None
    try:
        return Description(**values)
    except UserError as error:
        raise UserError(f"description {path.name}: {error}" if path else str(error)) from None


def _points(value: Any) -> tuple[Point, ...]:
    if isinstance(value, list | tuple) and all(_is_point(point) for point in value):
        return tuple((float(x), float(y)) for x, y in value)
    raise TypeError


def _is_point(value: Any) -> bool:
    return (
        isinstance(value, list | tuple)
        and len(value) == 2
        and all(isinstance(number, int | float) and not isinstance(number, bool) for number in value)
        and all(isfinite(number) for number in value)
    )


def _clamp(value: Any) -> Any:
    if isinstance(value, str):
        return value
    if isinstance(value, list | tuple) and len(value) == 2 and all(_is_point(point) for point in value):
        value = [value]
    try:
        pairs = tuple(_points(pair) for pair in value)
    except TypeError:
        pairs = ()
    if not pairs or any(len(pair) != 2 for pair in pairs):
        raise UserError(
            f"clamp = {value!r} is no pair of points; write clamp = [[0, 0], [0, -30]], several such pairs, "
            "or a label of the file"
        )
    return pairs


def _contact(value: Any) -> Any:
    if isinstance(value, str):
        return value
    if not _is_point(value):
        raise UserError(f"contact = {value!r} is no point; write contact = [35, 0] or a label of the file")
    return float(value[0]), float(value[1])


def _markers(value: Any) -> Any:
    if isinstance(value, str):
        return value
    if isinstance(value, int) and not isinstance(value, bool):
        if not 1 <= value <= 200:
            raise UserError(f"markers = {value} is outside its range, 1 to 200")
        return value
    try:
        points = _points(value)
    except TypeError:
        points = ()
    if not points:
        raise UserError(
            f"markers = {value!r} are no points; write markers = [[10, -1], [20, -1]], their number, or a "
            "label of the file"
        )
    return points


_READ = {"clamp": _clamp, "contact": _contact, "markers": _markers}

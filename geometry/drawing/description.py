"""Clamp, contact and markers of a drawn finger: a small TOML file beside the drawing, or lines of one."""

from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, field_validator

from pinnray.geometry.finger.parameters import CheckedModel, bounded
from pinnray.runtime.errors import UserError
from pinnray.runtime.text_files import parse_toml, read_toml

Coordinates = tuple[float, float]


class PartMaterial(CheckedModel):
    """Elastic constants of a part; the law and the plane state are those of the whole body."""

    young: float = bounded(..., 1e-6, 1e7, "MPa", "E", "Young's modulus")
    poisson: float = bounded(..., -0.99, 0.4999, "", "nu", "Poisson's ratio")


class Description(CheckedModel):
    """Clamp, contact and markers of a drawing, in the file's coordinates; what is missing is proposed.

    Lengths are in the file's unit, as the coordinates are; only the tolerance is in mm.
    """

    name: str | None = Field(
        default=None,
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$",
        description="What files and reports call the finger; none means the file's name",
    )
    units: Literal["um", "mm", "cm", "dm", "m", "mil", "in", "ft", "yd", "pt", "px"] | None = Field(
        default=None, description="Unit of the file's coordinates; none means the file's own, or mm"
    )
    tolerance: float | None = bounded(
        None, 1e-6, 0.5, "", "mm", "Largest gap between two ends of curves that is closed; none means 0.001"
    )
    plane: str | None = Field(default=None, description="Plane in which a solid is cut, such as z = 6")
    clamp: tuple[tuple[Coordinates, Coordinates], ...] | str | None = Field(
        default=None,
        description="Two points of the outline, or several such pairs: the boundary between them, the "
        "shorter way, is clamped; or a label of the file",
    )
    contact: Coordinates | str | None = Field(
        default=None, description="A point of the outline, where the indenter touches; or a label of the file"
    )
    contact_width: float | None = bounded(
        None, 1e-6, 2000, "", "", "Length of front face that the indenter touches, in the file's unit"
    )
    markers: tuple[Coordinates, ...] | int | str | None = Field(
        default=None, description="Centres of the markers, or their number, or a label of the file"
    )
    marker_diameter: float | None = bounded(
        None, 1e-6, 2000, "", "", "Diameter of a marker, in the file's unit"
    )
    marker_height: float | None = bounded(
        None, 1e-6, 2000, "", "", "How deep a marker is inlaid, in the file's unit"
    )
    depth: float | None = bounded(None, 1e-6, 2000, "", "", "Depth of the extrusion, in the file's unit")
    materials: dict[str, PartMaterial] | None = Field(
        default=None,
        description="Young's modulus, MPa, and Poisson's ratio of parts: of a Gmsh mesh's physical surfaces",
    )

    @field_validator("clamp", mode="before")
    @classmethod
    def _read_clamp(cls, value: Any) -> Any:
        if value is None or isinstance(value, str):
            return value
        pairs = [value] if _are_points(value, 2) else value
        if not (isinstance(pairs, list | tuple) and pairs and all(_are_points(pair, 2) for pair in pairs)):
            raise ValueError(
                "no pair of points; write clamp = [[0, 0], [0, -30]], several such pairs, or a label"
            )
        return tuple(tuple((float(x), float(y)) for x, y in pair) for pair in pairs)

    @field_validator("contact", mode="before")
    @classmethod
    def _read_contact(cls, value: Any) -> Any:
        if not (value is None or isinstance(value, str) or _are_points([value])):
            raise ValueError("no point; write contact = [35, 0] or a label of the file")
        return value

    @field_validator("markers", mode="before")
    @classmethod
    def _read_markers(cls, value: Any) -> Any:
        if isinstance(value, int) and not isinstance(value, bool) and not 1 <= value <= 200:
            raise ValueError("outside its range, 1 to 200")
        if value is None or type(value) in (str, int) or _are_points(value):
            return value
        raise ValueError(
            "no points; write markers = [[10, -1], [20, -1]], their number, or a label of the file"
        )


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


def _are_points(value: Any, count: int | None = None) -> bool:
    """Whether a value is a list of pairs of finite numbers, `count` of them if it is given."""
    return (
        isinstance(value, list | tuple)
        and len(value) > 0
        and count in (None, len(value))
        and all(isinstance(point, list | tuple) and len(point) == 2 for point in value)
        and all(type(number) in (int, float) and isfinite(number) for point in value for number in point)
    )

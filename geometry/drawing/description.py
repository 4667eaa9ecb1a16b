"""Clamp, contact and markers of a drawn finger: a small TOML file beside the drawing, or lines of one."""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, ValidationError, ValidationInfo, field_validator

from pinnray.geometry.finger.learned import TABLE
from pinnray.geometry.finger.parameters import CheckedModel, bounded
from pinnray.runtime.errors import UserError
from pinnray.runtime.text_files import read_toml

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Coordinates = tuple[Number, Number]
Points = Annotated[tuple[Coordinates, ...], Field(min_length=1)]

DRAWINGS = (".step", ".stp", ".dxf", ".svg", ".msh")
"""Endings of the files that are read as drawings."""

EXPECTED = {
    "clamp": "write clamp = [[0, 0], [0, -30]], or several such pairs",
    "contact": "write contact = [35, 0]",
    "markers": "write markers = [[10, -1], [20, -1]], or their number, 1 to 200",
}
"""Values of the description that may be of several types."""


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
        None, 1e-6, 0.5, "Largest gap between two ends of curves that is closed; none means 0.001", "", "mm"
    )
    plane: str | None = Field(default=None, description="Plane in which a solid is cut, such as z = 6")
    clamp: Annotated[tuple[tuple[Coordinates, Coordinates], ...], Field(min_length=1)] | None = Field(
        default=None,
        description="Two points of the outline, or several such pairs: the boundary between them, the "
        "shorter way, is clamped",
    )
    contact: Coordinates | None = Field(
        default=None, description="A point of the outline, where the indenter touches"
    )
    contact_width: float | None = bounded(
        None, 1e-6, 2000, "Length of front face that the indenter touches, in the file's unit"
    )
    markers: Points | Annotated[int, Field(strict=True, ge=1, le=200)] | None = Field(
        default=None, description="Centres of the markers, or their number"
    )
    marker_diameter: float | None = bounded(None, 1e-6, 2000, "Diameter of a marker, in the file's unit")
    marker_height: float | None = bounded(None, 1e-6, 2000, "How deep a marker is inlaid, in the file's unit")
    depth: float | None = bounded(None, 1e-6, 2000, "Depth of the extrusion, in the file's unit")

    @field_validator("clamp", mode="before")
    @classmethod
    def _as_pairs(cls, value: Any) -> Any:
        """One pair of points as several."""
        try:
            return [value] if np.shape(value) == (2, 2) else value
        except ValueError:  # of rows of different lengths
            return value

    @field_validator("clamp", "contact", "markers", mode="wrap")
    @classmethod
    def _in_one_line(cls, value: Any, check: Any, info: ValidationInfo) -> Any:
        """The value, or what is expected instead of the message for each type that it might have."""
        try:
            return None if value is None else check(value)
        except ValidationError:
            raise ValueError(EXPECTED[str(info.field_name)]) from None


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
        values.pop(TABLE, None)  # for `read_learned`
    for text in lines:
        try:
            values |= tomllib.loads(text)
        except ValueError:
            raise UserError(f"cannot read {text!r}; write TOML, such as contact = [35, 0]") from None
    try:
        return Description(**values)
    except UserError as error:
        raise UserError(f"description {path.name}: {error}" if path else str(error)) from None

"""The parameters of a finger: names, the paper's symbols, units and bounds; mm and degrees throughout.

Invalid values are refused in one line: the parameter, the value, and the allowed ones.
"""

import difflib
import reprlib
from collections.abc import Mapping, Sequence
from functools import cache
from textwrap import shorten
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator
from pydantic_core import ErrorDetails

from pinnray.runtime.content_hash import content_hash
from pinnray.runtime.errors import UserError


def bounded(
    default: Any, low: float, high: float, meaning: str, unit: str = "", symbol: str = "", **limits: float
) -> Any:
    """A bounded number of a model, with its description for messages and help texts.

    With other `limits` of pydantic, the bounds are those that a study may span.
    """
    ends: Any = limits or {"ge": low, "le": high}
    return Field(
        default=default,
        **ends,
        description=f"{meaning} [{unit}]" if unit else meaning,
        json_schema_extra={"unit": unit, "symbol": symbol, "low": low, "high": high},
    )


MARKER = 1.6
"""Diameter of a marker, mm, unless another one is asked for; thin walls get smaller ones of themselves."""


class CheckedModel(BaseModel):
    """A frozen model that refuses invalid values in one line; a parameter goes by its name or its symbol.

    Raises:
        UserError: With the parameter, the value and what would be right; semicolons between several. Likewise
            if a value is given without its name.
    """

    # Its schema is built when it is used, as `--help` only lists its fields.
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)
    other_words: ClassVar[tuple[str, ...]] = ()  # which `__init__` turns into parameters

    if not TYPE_CHECKING:  # type checkers see the parameters instead, each with its type

        def __init__(self, *unnamed, **given) -> None:
            if unnamed:
                names = shorten(", ".join(type(self).model_fields), 120, placeholder=" ...")
                said = " ".join(reprlib.repr(unnamed[0]).split())
                raise UserError(f"{type(self).__name__} takes values by name only ({names}), not {said}")
            values = by_parameter_name(given, type(self))
            for name, value in values.items():
                field = type(self).model_fields.get(name)
                numeric = field and field.annotation in (int, float, int | None, float | None)
                if numeric and isinstance(value, bool):
                    values[name] = str(value).lower()  # no number, though Python has it as 0 or 1
            try:
                super().__init__(**values)
            except ValidationError as error:
                sentences = (_sentence(problem, type(self)) for problem in error.errors())
                raise UserError("; ".join(sentences)) from None


class Parameters(CheckedModel):
    """Numbers that describe a finger, each within its own bounds; `Design` also checks them together.

    Frame: x runs from the base (0) to the tip (`height`); the front (contact) face is y = 0 and the body
    lies in y <= 0. The base line runs from (0, 0) over `base_width`, along -y or tilted toward the tip; the
    back face is the line from its end to the apex (height, 0). The base line is clamped or, with a foot below
    it, the foot's underside. The section is extruded along z from 0 to `depth`.

    `height` to `back_thickness` are the paper's nine. The paper does not give base wall and tilt, the ribs'
    places and the line that their slope is measured from, roundings, the foot, the contact's width and the
    markers: those values are this project's.
    """

    name: str = Field(
        default="default",
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$",
        description="What files and reports call the design; no part of the geometry",
    )
    height: float = bounded(90.0, 10, 500, "Length from the base to the tip", "mm", "H")
    base_width: float = bounded(30.0, 3, 200, "Width of the base, in the plane", "mm", "L")
    depth: float = bounded(20.0, 1, 200, "Depth of the extrusion, out of the plane", "mm", "W")
    rib_angle: float = bounded(
        20.0,
        -60,
        60,
        "Slope of the ribs from the line of `rib_reference`, positive toward the tip",
        "deg",
        "L_angle",
    )
    tip_length: float = bounded(20.0, 1, 300, "Length of the solid tip, along the front face", "mm", "L_tip")
    rib_count: int = bounded(4, 0, 60, "Number of ribs", "", "N")
    rib_thickness: float = bounded(2.0, 0.2, 30, "Rib thickness, normal to the rib", "mm", "t_rib")
    front_thickness: float = bounded(2.0, 0.2, 30, "Thickness of the front (contact) wall", "mm", "t_flex")
    back_thickness: float = bounded(
        2.0, 0.2, 30, "Thickness of the back wall, normal to the back face", "mm", "t_back"
    )
    base_thickness: float = bounded(2.0, 0, 100, "Thickness of the wall inside the base line", "mm")
    base_tilt: float = bounded(
        0.0, -45, 45, "Tilt of the base line from the front's normal, toward the tip at the back", "deg"
    )
    rib_reference: Literal["front", "base"] = Field(
        default="front",
        description="Line from which `rib_angle` is measured: the front wall's normal, or the base line",
    )
    rib_start: float | None = bounded(
        None,
        0,
        500,
        "Abscissa of the first rib's axis on the front wall's inner face; none: a pitch from the base wall",
        "mm",
    )
    rib_pitch: float | None = bounded(
        None, 0.2, 500, "Distance of the rib axes along the front wall; none spaces them evenly", "mm"
    )
    tip_radius: float = bounded(0.0, 0, 100, "Radius of the tip's rounding; 0 leaves it sharp", "mm")
    foot_height: float = bounded(0.0, 0, 200, "Height of the foot below the base line; 0: no foot", "mm")
    slot_width: float = bounded(0.0, 0, 200, "Width of the T-slot in the foot; 0: no slot", "mm")
    slot_opening: float = bounded(0.0, 0, 200, "Width of the slot's opening, between the two lips", "mm")
    slot_height: float = bounded(0.0, 0, 200, "Height of the slot's wide part", "mm")
    lip_thickness: float = bounded(0.0, 0, 200, "Thickness of the lips beside the slot's opening", "mm")
    fillet_radius: float = bounded(0.0, 0, 20, "Radius of the cavities' corners; 0 leaves them sharp", "mm")
    contact_position: float | None = bounded(
        None, 0, 500, "Middle of the contact, from the base; none means (height - tip_length) / 2", "mm"
    )
    contact_width: float = bounded(2.0, 0.1, 100, "Length of front face that the indenter touches", "mm")
    marker_layout: Literal["front", "joints"] = Field(
        default="joints",
        description="Markers on the centre line of the front wall, or at the rib-wall joints and in the tip",
    )
    marker_count: int = bounded(9, 1, 60, "Number of markers of the layout `front`")
    marker_diameter: float = bounded(MARKER, 0.1, 20, "Diameter of a marker", "mm")
    marker_height: float = bounded(0.6, 0.05, 50, "How deep a marker is inlaid into the side face", "mm")

    @field_validator("tip_radius", "fillet_radius", "foot_height")
    @classmethod
    def _left_out_or_there(cls, length: float) -> float:
        if 0 < length < 0.01:  # could not be meshed
            raise ValueError("give 0 to leave it out, or at least 0.01 mm")
        return length

    @property
    def marker_radius(self) -> float:
        """Radius of a marker's disc, mm: a marker's displacement is the mean over this disc."""
        return self.marker_diameter / 2

    @property
    def contact_abscissa(self) -> float:
        """X of the contact's middle on the front face, mm."""
        middle = (self.height - self.tip_length) / 2
        return middle if self.contact_position is None else self.contact_position

    @property
    def contact_ends(self) -> tuple[float, float]:
        """X of both ends of the contact, mm."""
        half = self.contact_width / 2
        return self.contact_abscissa - half, self.contact_abscissa + half

    @property
    def digest(self) -> str:
        """SHA-256 over everything but the name, in hexadecimal; equal for equal fingers."""
        values = self.model_dump(exclude={"name"}) | {"contact_position": self.contact_abscissa}
        return content_hash(values)


def value_and_deviation(text: str) -> tuple[str, str]:
    """A measured value and its standard deviation out of `11.4±1.2` or `11.4+-1.2`; empty without one."""
    value, _, deviation = text.replace("+/-", "±").replace("+-", "±").partition("±")
    return value.strip(), deviation.strip()


def parameter_info(
    name: str, key: Literal["unit", "symbol", "low", "high"], model: type[BaseModel] = Parameters
) -> Any:
    """Unit, symbol or bound of a model's parameter; an empty text where there is none."""
    field = model.model_fields.get(name)
    extra = field.json_schema_extra if field else None
    return extra.get(key, "") if isinstance(extra, dict) else ""


def with_unit(value: float, name: str, model: type[BaseModel] = Parameters) -> str:
    """A value of the parameter `name` in words, such as `2.5 mm`."""
    return f"{value:.6g} {parameter_info(name, 'unit', model)}".rstrip()


def with_symbol(name: str, model: type[BaseModel] = Parameters) -> str:
    """The parameter's name with the paper's symbol, such as `rib_count (N)`."""
    symbol = parameter_info(name, "symbol", model)
    return f"{name} ({symbol})" if symbol else name


@cache
def symbols(model: type[BaseModel]) -> dict[str, str]:
    """Names of a model's parameters by their symbols."""
    return {symbol: name for name in model.model_fields if (symbol := parameter_info(name, "symbol", model))}


SYMBOLS = symbols(Parameters)
"""Parameter names by the paper's symbols."""


def by_parameter_name(values: Mapping[str, Any], model: type[BaseModel] = Parameters) -> dict[str, Any]:
    """The values with a model's symbols replaced by the names of its parameters.

    Raises:
        UserError: If a parameter is given by its name and by its symbol.
    """
    known, named = symbols(model), dict[str, Any]()
    for key, value in values.items():
        name = known.get(key, key)
        if name in named:
            raise UserError(
                f"{with_symbol(name, model)} is given twice, by its name and by its symbol; give it once"
            )
        named[name] = value
    return named


def unknown_parameter(key: str, *models: type[CheckedModel], besides: Sequence[str] = ()) -> str:
    """The message for a parameter that no model has: near matches, or the whole list.

    Args:
        key: The unknown word.
        models: Models that were searched.
        besides: Further words that would have been understood.
    """
    titles = {name: with_symbol(name, model) for model in models for name in model.model_fields}
    titles |= {name: name for name in besides}
    near = difflib.get_close_matches(key.lower(), titles, n=3, cutoff=0.6)
    said = ", ".join(titles[name] for name in near or titles)
    return f"unknown parameter {key!r}; {f'did you mean {said}?' if near else f'there are {said}'}"


def _sentence(problem: ErrorDetails, model: type[CheckedModel]) -> str:
    kind, value, context = problem["type"], problem["input"], problem.get("ctx", {})
    if not problem["loc"]:
        return str(context.get("error", problem["msg"]))
    name = str(problem["loc"][0])
    if kind == "extra_forbidden":
        return unknown_parameter(name, model, besides=model.other_words)
    titled = with_symbol(name, model)
    if kind in ("greater_than_equal", "less_than_equal"):
        try:
            given = with_unit(float(value), name, model)
        except OverflowError:
            given = reprlib.repr(value)
        return f"{titled} = {given} is outside its range, {_bounds(name, model)}"
    titled = f"{titled} = {' '.join(reprlib.repr(value).split())}"  # an array's text has several lines
    if kind in ("int_from_float", "int_parsing", "int_type"):
        return f"{titled} is not a whole number{_advice(name, model)}"
    if kind in ("float_parsing", "float_type", "finite_number"):
        return f"{titled} is not a finite number{_advice(name, model)}"
    if kind == "string_pattern_mismatch":
        return f"{titled} must be a letter or digit, then only letters (A to Z), digits, '.', '_', '-'"
    return f"{titled}: {context['error'] if kind == 'value_error' else problem['msg'].lower()}"


def _bounds(name: str, model: type[BaseModel]) -> str:
    low, high = parameter_info(name, "low", model), parameter_info(name, "high", model)
    return f"{low:g} to {with_unit(high, name, model)}"


def _advice(name: str, model: type[BaseModel]) -> str:
    """The end of a message with the parameter's bounds; empty where it has none."""
    return f"; give one from {_bounds(name, model)}" if parameter_info(name, "low", model) != "" else ""

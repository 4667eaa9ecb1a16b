"""Models whose invalid values are refused in one line: the parameter, the value, and the allowed ones."""

import difflib
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

from geometry.errors import UserError
from geometry.finger.parameters import parameter_info, title, with_unit


class CheckedModel(BaseModel):
    """A frozen model that refuses invalid values in one line.

    Raises:
        UserError: With the parameter, the value and what would be right.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def __init__(self, **values: Any) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise UserError(validation_message(error, type(self))) from None


def validation_message(error: ValidationError, model: type[BaseModel]) -> str:
    """A pydantic error of `model` as one line; several problems are separated by semicolons."""
    return "; ".join(_sentence(problem, model) for problem in error.errors())


def unknown_parameter(key: str, model: type[BaseModel]) -> str:
    """The message for a parameter that `model` does not have: near matches, or the whole list."""
    known = list(model.model_fields)
    near = difflib.get_close_matches(key.lower(), known, n=3, cutoff=0.6)
    near = near or [name for name in known if key.lower() in name or key.lower()[:3] == name[:3]]
    titles = ", ".join(title(name, model) for name in near or known)
    hint = f"did you mean {titles}?" if near else f"there are {titles}"
    return f"unknown parameter {key!r}; {hint}"


def _sentence(problem: ErrorDetails, model: type[BaseModel]) -> str:
    kind, value, context = problem["type"], problem["input"], problem.get("ctx", {})
    if not problem["loc"]:
        return str(context.get("error", problem["msg"]))
    name = str(problem["loc"][0])
    if kind == "extra_forbidden":
        return unknown_parameter(name, model)
    titled = title(name, model)
    if kind in ("greater_than_equal", "less_than_equal"):
        given = with_unit(float(value), name, model)
        return f"{titled} = {given} is outside its range, {_bounds(name, model)}"
    if kind in ("int_from_float", "int_parsing", "int_type"):
        return f"{titled} = {value!r} is not a whole number; give one from {_bounds(name, model)}"
    if kind in ("float_parsing", "float_type", "finite_number"):
        return f"{titled} = {value!r} is not a finite number; give one from {_bounds(name, model)}"
    if kind == "string_pattern_mismatch":
        return f"{titled} = {value!r} must be a letter or digit, then only letters, digits, '.', '_', '-'"
    return f"{titled} = {value!r}: {problem['msg'].lower()}"


def _bounds(name: str, model: type[BaseModel]) -> str:
    low, high = parameter_info(name, "low", model), parameter_info(name, "high", model)
    return f"{low:g} to {with_unit(high, name, model)}"

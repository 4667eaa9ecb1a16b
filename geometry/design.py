"""The design of a finger: parameters that obey every rule."""

import difflib
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ValidationError, model_validator
from pydantic_core import ErrorDetails

from geometry.admissible import check
from geometry.errors import UserError
from geometry.parameters import SYMBOLS, Parameters, fact, title, with_unit


class Design(Parameters):
    """A finger that can be made; a combination that cannot be is refused on construction.

    Every parameter goes by its name or by the paper's symbol: `Design(rib_count=6)` equals `Design(N=6)`.

    Raises:
        UserError: One line with the parameter, the value, the reason and what would be right.
    """

    def __init__(self, **values: Any) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise UserError(one_line(error)) from None

    def replaced(self, **changes: Any) -> "Design":
        """A checked copy with some parameters changed, by name or symbol."""
        return Design(**{**self.model_dump(), **by_name(changes)})

    @model_validator(mode="before")
    @classmethod
    def _accept_symbols(cls, values: Any) -> Any:
        return by_name(values) if isinstance(values, Mapping) else values

    @model_validator(mode="after")
    def _obey_rules(self) -> "Design":
        check(self)
        return self


def by_name(values: Mapping[str, Any]) -> dict[str, Any]:
    """The values with the paper's symbols turned into names.

    Raises:
        UserError: If a parameter is given by name and by symbol.
    """
    named: dict[str, Any] = {}
    for key, value in values.items():
        name = SYMBOLS.get(key, key)
        if name in named:
            raise UserError(f"{title(name)} is given twice, by its name and by its symbol; give it once")
        named[name] = value
    return named


def one_line(error: ValidationError, model: type[BaseModel] = Parameters) -> str:
    """A pydantic error as one line that says which parameter, what value, and what would be right."""
    return "; ".join(_sentence(problem, list(model.model_fields)) for problem in error.errors())


def unknown_parameter(key: str, known: list[str]) -> str:
    """What to say about a parameter that does not exist: near matches, or the whole list."""
    near = difflib.get_close_matches(key.lower(), known, n=3, cutoff=0.6)
    near = near or [name for name in known if key.lower() in name]
    titles = ", ".join(title(name) if name in Parameters.model_fields else name for name in near or known)
    return (
        f"unknown parameter {key!r}; {'did you mean' if near else 'there are'} {titles}{'?' if near else ''}"
    )


def _sentence(problem: ErrorDetails, known: list[str]) -> str:
    kind, value, context = problem["type"], problem["input"], problem.get("ctx", {})
    if not problem["loc"]:
        return str(context.get("error", problem["msg"]))
    name = str(problem["loc"][0])
    if kind == "extra_forbidden":
        return unknown_parameter(name, known)
    what = title(name) if name in Parameters.model_fields else name
    if kind in ("greater_than_equal", "less_than_equal"):
        return f"{what} = {with_unit(float(value), name)} is outside its range, {_bounds(name)}"
    if kind in ("int_from_float", "int_parsing", "int_type"):
        return f"{what} = {value!r} is not a whole number; give one from {_bounds(name)}"
    if kind in ("float_parsing", "float_type", "finite_number"):
        return f"{what} = {value!r} is not a finite number; give one from {_bounds(name)}"
    if kind == "string_pattern_mismatch":
        return f"{what} = {value!r} must be a letter or digit, then only letters, digits, '.', '_', '-'"
    return f"{what} = {value!r}: {problem['msg'].lower()}"


def _bounds(name: str) -> str:
    if name not in Parameters.model_fields:
        return "its bounds"
    return f"{fact(name, 'low'):g} to {with_unit(fact(name, 'high'), name)}"

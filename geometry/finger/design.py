"""The design of a finger: parameters that obey every rule."""

from collections.abc import Mapping
from typing import Any

from pydantic import model_validator

from geometry.errors import UserError
from geometry.finger.checked_model import CheckedModel
from geometry.finger.parameters import SYMBOLS, Parameters, title
from geometry.finger.validation import check


class Design(CheckedModel, Parameters):
    """A valid finger; invalid combinations of parameters are refused on construction.

    Every parameter goes by its name or by the paper's symbol: `Design(rib_count=6)` equals `Design(N=6)`.
    """

    def replaced(self, **changes: Any) -> "Design":
        """A checked copy with some parameters changed, by name or symbol."""
        return Design(**{**self.model_dump(), **by_parameter_name(changes)})

    @model_validator(mode="before")
    @classmethod
    def _accept_symbols(cls, values: Any) -> Any:
        return by_parameter_name(values) if isinstance(values, Mapping) else values

    @model_validator(mode="after")
    def _obey_rules(self) -> "Design":
        check(self)
        return self


def by_parameter_name(values: Mapping[str, Any]) -> dict[str, Any]:
    """The values with the paper's symbols replaced by names.

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

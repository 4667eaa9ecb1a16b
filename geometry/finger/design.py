"""The design of a finger: parameters that obey every rule."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from pydantic import model_validator

from geometry.errors import UserError
from geometry.finger.parameters import SYMBOLS, Parameters, title, with_unit
from geometry.finger.validation import check
from geometry.notebook import fact_table

if TYPE_CHECKING:
    from geometry.figure import Figure


class Design(Parameters):
    """A valid finger; invalid combinations of parameters are refused on construction.

    Every parameter goes by its name or by the paper's symbol: `Design(rib_count=6)` equals `Design(N=6)`.
    """

    def replaced(self, **changes: Any) -> "Design":
        """A checked copy with some parameters changed, by name or symbol."""
        return Design(**{**self.model_dump(), **by_parameter_name(changes)})

    def plot(self) -> "Figure":
        """The section to scale, with its markers and the contact, as a matplotlib figure."""
        from geometry.finger.picture import plot_design

        return plot_design(self)

    def _repr_html_(self) -> str:
        """The section and the paper's nine parameters, in a notebook."""
        from geometry.finger.svg import section_svg

        facts = {
            f"{name} ({symbol})": with_unit(getattr(self, name), name) for symbol, name in SYMBOLS.items()
        }
        return fact_table(f"Design “{self.name}”", facts, section_svg(self).partition("?>")[2])

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

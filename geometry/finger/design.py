"""A finger from parameters that obey every rule."""

import json
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import model_validator

from pinnray.geometry.finger.markers import marker_positions
from pinnray.geometry.finger.parameters import (
    MARKER,
    SYMBOLS,
    Parameters,
    by_parameter_name,
    parameter_info,
    with_unit,
)
from pinnray.geometry.finger.rules import broken_rule, fitting_marker
from pinnray.geometry.finger.section import finger_section
from pinnray.geometry.section.section import Section
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.runtime.notebook import fact_table

if TYPE_CHECKING:
    from pinnray.runtime.figure import Figure


class Design(Parameters):
    """A valid finger; invalid combinations of parameters are refused on construction.

    Every parameter goes by its name or by the paper's symbol: `Design(rib_count=6)` equals `Design(N=6)`.
    """

    def replaced(self, **changes: Any) -> "Design":
        """A checked copy with some parameters changed, by name or symbol."""
        return Design(**{**self.model_dump(exclude_unset=True), **by_parameter_name(changes)})

    @property
    def section(self) -> Section:
        """The section; its outline has the pieces `base`, `back`, `tip`, `front`, and those of a foot."""
        return finger_section(self)

    @property
    def markers(self) -> FloatArray:
        """Centres of the markers, ordered from base to tip, shape (m, 2), mm."""
        return marker_positions(self)

    @property
    def small_markers(self) -> str:
        """Why the markers are smaller than usual, if walls are too thin for others; else empty."""
        usual = self.model_copy(update={"marker_diameter": MARKER})
        if self.marker_diameter < MARKER and fitting_marker(usual) == self.marker_diameter:
            return f"the usual {MARKER:g} mm do not fit"
        return ""

    def at_contact(self, position: float) -> "Design":
        """The same finger with the contact's middle at another x, mm."""
        return self.replaced(contact_position=position)

    def definition(self) -> dict[str, Any]:
        """Every parameter by name."""
        return self.model_dump()

    def lines(self) -> str:
        """Every parameter that differs from its default, as the lines of a design file, whose name it has."""
        own = self.model_dump(exclude_defaults=True, exclude_none=True, exclude={"name"})
        return "".join(f"{name} = {json.dumps(value)}\n" for name, value in own.items())

    def facts(self) -> list[tuple[str, str, str]]:
        """Meaning, symbol of the paper and value with unit; without zeros that the paper does not have."""
        rows = []
        for name, described in type(self).model_fields.items():
            value = getattr(self, name)
            symbol = str(parameter_info(name, "symbol"))
            if name in ("name", "contact_position") or value is None or not (value or symbol):
                continue
            meaning = (described.description or name).split(" [")[0].replace("`", "")
            unit = str(parameter_info(name, "unit"))
            words = _in_words(value, unit)
            if name == "marker_diameter" and self.small_markers:
                words += f", as {self.small_markers}"
            rows.append((meaning, symbol, words))
        return [*rows, ("Middle of the contact, from the base", "", _in_words(self.contact_abscissa, "mm"))]

    def plot(self, width: float | None = None) -> "Figure":
        """The section with clamp, contact and numbered markers, as a matplotlib figure."""
        from pinnray.geometry.finger.picture import plot_finger

        return plot_finger(self, self.section, np.asarray, width)

    def _repr_html_(self) -> str:
        """The section and the paper's nine parameters, in a notebook."""
        facts = {
            f"{name} ({symbol})": with_unit(getattr(self, name), name) for symbol, name in SYMBOLS.items()
        }
        if self.small_markers:
            facts["markers"] = f"of {self.marker_diameter:g} mm: {self.small_markers}"
        return fact_table(f"Design “{self.name}”", facts, self.plot()._repr_png_())

    def __repr__(self) -> str:
        """The name, the paper's nine parameters and what else differs from its default, in one line."""
        shown = {"name", *SYMBOLS.values()} | {
            name for name, field in type(self).model_fields.items() if getattr(self, name) != field.default
        }
        return f"Design({', '.join(f'{name}={value!r}' for name, value in self if name in shown)})"

    __str__ = __repr__

    @model_validator(mode="after")
    def _obey_rules(self) -> "Design":
        if fault := broken_rule(self):
            raise UserError(fault)
        self.__dict__["marker_diameter"] = fitting_marker(self)  # still unset: a copy has its own walls
        return self


def _in_words(value: object, unit: str) -> str:
    number = f"{value:g}" if isinstance(value, int | float) else str(value)
    return number + {"": "", "deg": "°"}.get(unit, f" {unit}")

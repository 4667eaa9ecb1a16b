"""Numbers as text; tables of texts for the terminal and pages, of cells for CSV files, written atomically."""

import csv
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, isnan
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.table import Table

from pinnray.runtime.atomic import atomic_path
from pinnray.runtime.exits import shown

Cell = str | int | float | bool
NONE = "–"
"""Stands where there is no number."""
LEAST_PERCENT, LEAST_DISTANCE = 0.001, 0.0001
"""Smaller shares, %, and lengths, mm, are printed as less than this: they are as good as zero."""


def write_csv(path: Path, rows: Sequence[Mapping[str, Cell | None]]) -> None:
    """Write rows with equal keys under a header, atomically; numbers keep all their digits, None is empty."""
    with atomic_path(path) as partial, partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


@dataclass(frozen=True)
class TextTable:
    """A table of texts; `tables.html.j2` has the macro that puts it on a page.

    Attributes:
        title: Above the table.
        headings: Headings of the columns.
        rows: As many texts as headings.
        caption: Below the table.
        left: Headings of the columns that are aligned to the left.
    """

    title: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""
    left: Collection[str] = ()


def terminal_table(
    title: str,
    headings: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    caption: str = "",
    left: Collection[str] = (),
    narrow: bool = False,
) -> Table:
    """A table of texts for the terminal; arguments as the attributes of `TextTable`.

    `narrow` sets the columns as close as they can stand.
    """
    table = Table(
        title=title or None,
        caption=caption or None,
        box=SIMPLE_HEAD,
        title_justify="left",
        caption_justify="left",
        padding=0 if narrow else (0, 1),
        pad_edge=not narrow,
    )
    for heading in headings:
        table.add_column(heading, justify="left" if heading in left else "right", no_wrap=True)
    for row in rows:
        table.add_row(*map(shown, row))
    return table


def significant(value: float, digits: int) -> str:
    """A number with so many significant digits, without an exponent below a million."""
    return f"{float(f'{value:.{digits}g}'):g}"


def number(value: float, digits: int = 4) -> str:
    """The same with trailing zeros and a typographic minus; no exponent from 1 to a million.

    A dash for a number that is not finite.
    """
    if not isfinite(value):
        return NONE
    text = f"{value:#.{digits}g}"
    if 1 <= abs(value) < 1e6:
        text = f"{float(text):.0f}" if "e" in text else text
    return text.rstrip(".").replace("-", "−")


def percent(share: float, digits: int = 3, *, sign: bool = True) -> str:
    """A share in per cent: so many significant digits, at least all before the point.

    A dash for a share that is not finite.

    Args:
        share: 0.123 is 12.3 %.
        digits: How many significant digits.
        sign: Whether the per cent sign follows, after a no-break space.
    """
    if not isfinite(share):
        return NONE
    value = 100 * share
    if value == 0:
        text = "0"
    elif abs(value) < LEAST_PERCENT:
        text = f"{'>' if value < 0 else '<'} {'−' * (value < 0)}{LEAST_PERCENT}".replace(
            " ", "\N{NO-BREAK SPACE}"
        )
    else:
        text = f"{value:.0f}".replace("-", "−") if abs(value) >= 10**digits else number(value, digits)
    return f"{text}\N{NO-BREAK SPACE}%" if sign else text


def distance(value: float) -> str:
    """A small length, mm, with two significant digits; a dash for NaN, zero for rounding errors."""
    if isnan(value):
        return NONE
    if value > 1e-9 and value < LEAST_DISTANCE:
        return f"<\N{NO-BREAK SPACE}{LEAST_DISTANCE}"
    return f"{value if value > 1e-9 else 0:.2g}"

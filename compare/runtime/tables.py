"""Tables: as CSV files, written atomically, and for the terminal."""

import csv
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.table import Table

from compare.runtime.exits import shown
from geometry.atomic import atomic_path

Cell = str | int | float | bool


def write_csv(path: Path, rows: Sequence[dict[str, Cell]]) -> None:
    """Write rows with equal keys under a header, atomically; numbers keep all their digits.

    A text that a spreadsheet would take for a formula, as a file of others may be called, gets an apostrophe.
    """
    with atomic_path(path) as partial, partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows({key: plain(cell) for key, cell in row.items()} for row in rows)


def plain(cell: Cell) -> Cell:
    """The cell, a text that begins like a formula with an apostrophe before it.

    Source: OWASP, CSV Injection.
    """
    if not isinstance(cell, str) or not cell.startswith(("=", "+", "-", "@", "\t", "\r")):
        return cell
    try:
        float(cell)
    except ValueError:
        return f"'{cell}"
    return cell


def terminal_table(
    title: str,
    headings: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    caption: str = "",
    left: Collection[str] = (),
    narrow: bool = False,
) -> Table:
    """A table with a title above and a caption below.

    Args:
        title: Above the table.
        headings: Headings of the columns.
        rows: As many texts as headings.
        caption: Below the table.
        left: Headings of the columns that are aligned to the left; the others are aligned to the right.
        narrow: Whether columns stand as close as they can.
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

"""The tables of `python -m benchmarks` in a narrow terminal."""

from io import StringIO

from rich.console import Console
from rich.table import Table

from benchmarks.__main__ import show


def test_headings_are_whole_in_a_terminal_of_80_columns() -> None:
    headings = [f"displacement {number}, relative" for number in range(6)]
    table = Table(*headings)
    table.add_row(*["0.123"] * 6)
    console = Console(file=StringIO(), width=80)
    show(table, console)
    assert all(heading in console.file.getvalue() for heading in headings)

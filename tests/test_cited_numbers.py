"""Numbers that pages repeat from a table: links whose title names the row and the column.

`[26 %](results.md "fem, displacement")` must be what the table of `docs/results.md` has there, rounded to as
many digits, with or without its sign. So a number has one source, the table that a command writes.
"""

import re
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.test_docs import PAGES, ROOT, id_of, without_blocks

CITED = re.compile(r'\[([^]\n]+)\]\(([^)\s#]*)(?:#[\w-]+)?\s+"([^",]+), ([^"]+)"\)')
NUMBER = re.compile(r"[+−-]?(\d[\d,]*(?:\.\d+)?)")


class Citation(NamedTuple):
    """A number on a page, and the cell that it is taken from."""

    page: Path
    text: str
    table: Path
    row: str
    column: str


def citations(page: Path) -> list[Citation]:
    found = CITED.findall(without_blocks(page.read_text(encoding="utf-8")))
    return [
        Citation(page, text, (page.parent / target).resolve() if target else page, row, column)
        for text, target, row, column in found
    ]


def cell(table: Path, row: str, column: str) -> str:
    """The cell of the first table of a page that has this row and this column; of it the first such row."""
    header: list[str] = []
    for line in table.read_text(encoding="utf-8").splitlines():
        if not line.startswith("|"):
            header = []
            continue
        cells = [each.replace("`", "").strip("* ") for each in line.strip("|").split("|")]
        header = header or cells
        if column in header and cells[0] == row:
            return cells[header.index(column)]
    raise LookupError(f"{table} has no table with the row {row!r} and the column {column!r}")


def value_of(cited: Citation) -> str:
    """The cell, or the share in per cent of two cells of one row: `error over moved`."""
    columns = cited.column.split(" over ")
    values = [cell(cited.table, cited.row, each) for each in columns]
    return values[0] if len(values) == 1 else f"{100 * float(values[0]) / float(values[1])} %"


def agrees(text: str, value: str) -> bool:
    """Whether a text's number is that of a cell, rounded; a quantity in times is not one in per cent."""
    said, true = NUMBER.search(text), NUMBER.search(value)
    if said is None or true is None or ("times" in text) != ("times" in value):
        return False
    digits = len(said[1].partition(".")[2])
    numbers = [float(each[1].replace(",", "")) for each in (said, true)]
    return abs(numbers[0] - numbers[1]) <= 0.5 * 10**-digits * (1 + 1e-9)


ALL = [each for page in PAGES for each in citations(page)]


@pytest.mark.parametrize("page", sorted({each.page for each in ALL}), ids=id_of)
def test_cited_numbers_are_those_of_the_tables(page):
    stale = [
        f"{each.text}: {each.row}, {each.column} is {value}"
        for each in ALL
        if each.page == page and not agrees(each.text, value := value_of(each))
    ]
    assert stale == []


def test_the_front_pages_cite_their_tables():
    assert {ROOT / "README.md", ROOT / "docs" / "results.md"} <= {each.page for each in ALL}


@pytest.mark.parametrize(
    ("text", "value", "same"),
    [
        ("26 %", "26 %", True),
        ("1.2 mm", "1.23", True),  # rounded
        ("14 % too small", "−14 %", True),  # the words have the sign
        ("26 %", "26.4 ± 1.1", True),  # the table's heading has the unit
        ("27 %", "26.4 ± 1.1", False),
        ("0.02 %", "0.026 %", False),
        ("24 times", "2400 %", False),
        ("a quarter", "25 %", False),
    ],
)
def test_a_number_agrees_with_a_cell(text, value, same):
    assert agrees(text, value) is same

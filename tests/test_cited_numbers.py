"""Numbers that pages repeat from a table: links whose title names the rows and the column.

`[26 to 4.7 %](results.md "fem and pinn-asm, displacement")` must be what the table of `docs/results.md` has
there, rounded to as many digits, with or without signs. So a number has one source, the table that a command
writes.
"""

import re
from pathlib import Path
from typing import NamedTuple

import pytest

from pinnray.options.preset_jobs import job_defaults
from tests.test_docs import PAGES, ROOT, id_of, without_blocks

CITED = re.compile(r'\[([^]]+)\]\(([^)\s#]*)(?:#[\w-]+)?\s+"([^",]+), ([^"]+)"\)')
NUMBER = re.compile(r"\d[\d,]*(?:\.\d+)?")


class Citation(NamedTuple):
    """Numbers on a page, and the cells that they are taken from."""

    page: Path
    text: str
    table: Path
    rows: list[str]
    column: str  # or two, of which the share in per cent is meant: "error over moved"

    @property
    def cells(self) -> list[str]:
        """What the table has in each row."""
        return [self._value(row) for row in self.rows]

    def _value(self, row: str) -> str:
        values = [cell(self.table, row, column) for column in self.column.split(" over ")]
        return values[0] if len(values) == 1 else f"{100 * float(values[0]) / float(values[1])} %"


def citations(page: Path) -> list[Citation]:
    found = CITED.findall(" ".join(without_blocks(page.read_text(encoding="utf-8")).split()))
    return [
        Citation(
            page, text, (page.parent / target).resolve() if target else page, rows.split(" and "), column
        )
        for text, target, rows, column in found
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


def agrees(text: str, cells: list[str]) -> bool:
    """Whether the numbers of a text are those of cells, rounded; one in times is not one in per cent."""
    said, true = NUMBER.findall(text), [NUMBER.findall(each)[0] for each in cells if NUMBER.search(each)]
    if len(said) != len(cells) or len(true) != len(cells):
        return False
    near = [
        abs(float(one.replace(",", "")) - float(other.replace(",", "")))
        <= 0.5 * 10 ** -len(one.partition(".")[2]) * (1 + 1e-9)
        for one, other in zip(said, true, strict=True)
    ]
    return all(near) and all(("times" in text) == ("times" in each) for each in cells)


ALL = [each for page in PAGES for each in citations(page)]


@pytest.mark.parametrize("page", sorted({each.page for each in ALL}), ids=id_of)
def test_cited_numbers_are_those_of_the_tables(page):
    cited = [each for each in ALL if each.page == page]
    assert [(*each[1:], each.cells) for each in cited if not agrees(each.text, each.cells)] == []


def test_the_front_pages_cite_their_tables():
    assert {ROOT / "README.md", ROOT / "docs" / "results.md"} <= {each.page for each in ALL}


@pytest.mark.parametrize("page", [page for page in PAGES if page.name != "CHANGELOG.md"], ids=id_of)
def test_a_page_counts_the_solvers_of_the_default_run(page):
    words = ("seven", "eight", "nine", "ten", "eleven")
    text = " ".join(page.read_text(encoding="utf-8").lower().split())
    counted = set(re.findall(rf"\b({'|'.join(words)}) solvers", text))
    assert counted <= {words[len(job_defaults(None).solvers.split(",")) - 7]}


@pytest.mark.parametrize(
    ("text", "cells", "same"),
    [
        ("26 %", ["26 %"], True),
        ("1.2 mm", ["1.23"], True),  # rounded
        ("14 % too small", ["−14 %"], True),  # the words have the sign
        ("26 %", ["26.4 ± 1.1"], True),  # the table's heading has the unit
        ("1.2 and 0.6 mm", ["1.23", "0.59"], True),
        ("1.2 and 0.6 mm", ["0.59", "1.23"], False),
        ("1.2 mm", ["1.23", "0.59"], False),
        ("27 %", ["26.4 ± 1.1"], False),
        ("0.02 %", ["0.026 %"], False),
        ("24 times", ["2400 %"], False),
        ("a quarter", ["25 %"], False),
    ],
)
def test_numbers_agree_with_cells(text, cells, same):
    assert agrees(text, cells) is same

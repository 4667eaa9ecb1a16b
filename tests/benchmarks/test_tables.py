"""Kept figures and tables between marks of a page."""

from pathlib import Path
from typing import NamedTuple

import pytest

from benchmarks.tables import END, fill, keep_rows, kept_rows, markdown, table_of


class Row(NamedTuple):
    name: str
    count: int
    error: float | None


def test_rows_are_kept_with_their_types(tmp_path: Path) -> None:
    rows = [Row("a, b", 1, 0.1), Row("c", 2, None)]
    keep_rows(tmp_path / "rows.csv", Row, rows)
    assert kept_rows(tmp_path / "rows.csv", Row) == rows
    assert kept_rows(tmp_path / "none.csv", Row) == []


def test_a_table_takes_the_place_between_its_marks(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(f"before\n<!-- one -->\nold\n{END}between\n<!-- two -->\nother\n{END}after\n")
    fill(page, "one", markdown(("a", "b"), [("x", "1")]))
    assert table_of(page, "one") == "| a | b |\n| --- | ---: |\n| x | 1 |\n"
    assert table_of(page, "two") == "other\n"
    text = page.read_text()
    assert text.endswith("after\n")
    assert "old" not in text
    with pytest.raises(ValueError, match="has no mark <!-- three -->"):
        fill(page, "three", "")

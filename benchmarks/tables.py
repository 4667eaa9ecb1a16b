"""Tables of figures: kept as CSV files, and in Markdown between two marks of a page."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import pandas as pd

from pinnray.runtime.atomic import write_text

DOCS = Path(__file__).parents[1] / "docs"
END = "<!-- end of the table -->\n"
Row = TypeVar("Row", bound=tuple[Any, ...])


def kept_rows(path: Path, kind: type[Row]) -> list[Row]:
    """The rows of a CSV file as named tuples; none if there is no file."""
    if not path.exists():
        return []
    table = pd.read_csv(path, float_precision="round_trip").astype(object)
    return [kind(*row) for row in table.where(table.notna(), None).to_numpy()]


def keep_rows(path: Path, kind: type[Row], rows: Iterable[Row]) -> None:
    """Write named tuples as a CSV file; None is an empty cell."""
    table = pd.DataFrame(rows, columns=kind._fields)  # type: ignore[attr-defined]
    write_text(path, table.to_csv(index=False, lineterminator="\n"))


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]], left: int = 1) -> str:
    """A table whose first columns are aligned to the left, the others to the right."""
    rule = ["---"] * left + ["---:"] * (len(header) - left)
    return "".join(f"| {' | '.join(cells)} |\n" for cells in (header, rule, *rows))


def begin_of(name: str) -> str:
    """The mark before a table."""
    return f"<!-- {name} -->\n"


def table_of(page: Path, name: str) -> str:
    """The table between its marks on a page."""
    return page.read_text(encoding="utf-8").partition(begin_of(name))[2].partition(END)[0]


def cells_of(page: Path, name: str) -> list[list[str]]:
    """The cells of the table between its marks on a page, without its header."""
    lines = table_of(page, name).splitlines()[2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def fill(page: Path, name: str, table: str) -> None:
    """Put a table between its marks on a page."""
    before, begin, rest = page.read_text(encoding="utf-8").partition(begin_of(name))
    if not begin:
        raise ValueError(f"{page} has no mark {begin_of(name).strip()}")
    write_text(page, before + begin + table + END + rest.partition(END)[2])

"""Tables: read from files, written atomically, for the terminal and pages; numbers as text."""

import csv
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from itertools import zip_longest
from math import isfinite, isnan
from pathlib import Path
from types import MappingProxyType

from rich.box import SIMPLE_HEAD
from rich.table import Table

from pinnray.runtime.atomic import atomic_path
from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import shown

SEPARATORS = ",;\t"
UNIT = re.compile(r"|[(\[].{0,12}[)\]]|mm|mm/mm|n/mm(?:\^?2|²)|px|%|[mkg]?pa|psi|n|s|-", re.I)
"""A cell of a line of units below the titles."""
DECIMAL_COMMA = re.compile(r"[-+]?(\d*|\d{1,3}(\.\d{3})+),\d+(e[-+]?\d+)?", re.I)
THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}((\.\d{3})+|(,\d{3})+)")
"""A whole number with points or commas between its thousands."""
WHOLE = re.compile(r"[-+]?(\d{3}|\d+([.,]\d{3}){2,})")
"""A number that is written without decimals in a column in which other marks may part thousands."""
POINT = re.compile(rf"(?!{THOUSANDS.pattern}$)[-+]?\d*\.\d+(e[-+]?\d+)?", re.I)
"""A number with a decimal point."""
EMPTY = frozenset({"", "nan", "na", "n/a", "#n/a", "null", "none"})
"""Texts of a number that is not there, in lower case: as of pandas, R and spreadsheets."""
MOST_TITLES = 12
"""Titles of a refused header that a message names."""
Cell = str | int | float | bool
NONE = "–"
"""Stands where there is no number."""
MANY_TIMES = 10.0
"""A share of which the size is larger is told as so many times: "24 times" and not "2400 %"."""
LEAST_PERCENT, LEAST_DISTANCE = 0.001, 0.0001
"""Smaller shares, %, and lengths, mm, are printed as less than this: they are as good as zero."""


@dataclass(frozen=True)
class ReadTable:
    """The wanted columns of a table in a file.

    Attributes:
        path: The file.
        titles: Title of every wanted column that is there, by its name, with the unit from a line of units.
        rows: The number of the line of every row, and its cells by the names of their columns.
        comments: Lines that begin with #.
    """

    path: Path
    titles: Mapping[str, str]
    rows: Sequence[tuple[int, Mapping[str, str]]]
    comments: Sequence[str]

    def numbers(self, besides: Collection[str] = ()) -> list[list[float]]:
        """The numbers of every row, NaN in a row that is empty `besides` some columns.

        Raises:
            UserError: If another cell holds no finite number.
        """
        numbers = []
        for line, cells in self.rows:
            numbers.append([read_number(cell) for cell in cells.values()])
            empty = all(cell.lower() in EMPTY for name, cell in cells.items() if name not in besides)
            for (name, cell), value in zip(cells.items(), numbers[-1], strict=True):
                if not isfinite(value) and not (empty and name not in besides):
                    raise UserError(
                        f"{self.path}, line {line}: {self.titles[name]} is {cell!r}, no finite number"
                    )
        return numbers


def read_table(
    path: Path, what: str, required: Mapping[str, str], optional: Mapping[str, str] = MappingProxyType({})
) -> ReadTable:
    """Read a table that programs and people save in many ways: columns, by their titles, in any order.

    Between the cells are commas, semicolons or tabs, with decimal commas unless there are commas between the
    cells. Before the titles may be a byte-order mark and lines of other text, below them a line of units.
    Blanks around cells, empty lines and separators at the end of a line do not count. A spreadsheet quotes
    comments with a comma, and appends separators to them.

    Args:
        path: The file.
        what: Its rows, in a message.
        required: Regular expressions of titles by the names of columns that must be there.
        optional: The same of columns that may be there.

    Raises:
        UserError: If it cannot be read, a column is missing or there twice, or a row has more or fewer cells
            than the header.
    """
    text, tables, fault = _text(path, what), [], None
    for separator in SEPARATORS:
        try:
            rows, comments = _rows(text, separator)
        except csv.Error as error:
            open_mark = str(error) == "unexpected end of data"
            reason = "a quotation mark is opened and not closed" if open_mark else "it is not a CSV file"
            fault = UserError(f"cannot read the {what} {path}: {reason}")
            continue
        width = len(rows[0][1]) if rows else 0
        named = [sum(map(bool, _places(cells, required).values())) for _, cells in rows]
        start = named.index(max(named)) if named else 0
        tables.append((len(required) in named, width, separator, rows[start:], comments))
    if fault and not any(found for found, *_ in tables):
        raise fault
    _, _, separator, rows, comments = max(tables, key=lambda table: table[:2])
    titles = rows[0][1] if rows else []
    while titles and not titles[-1]:
        titles.pop()
    places, body = columns_of(titles, required, optional, str(path)), rows[1:]
    if body and all(UNIT.fullmatch(cell) for cell in body[0][1]):
        units = zip_longest(titles, body.pop(0)[1][: len(titles)], fillvalue="")
        titles = [" ".join(pair).strip() for pair in units]
    read = []
    for line, cells in body:
        while len(cells) > len(titles) and not cells[-1]:
            cells.pop()
        if len(cells) != len(titles):
            raise UserError(
                f"{path}, line {line}: the header names {len(titles)} columns, this line has {len(cells)}; "
                "name every column, and write decimals with a point or put semicolons between the cells"
            )
        read.append((line, {name: cells[place] for name, place in places.items()}))
    commas = separator != "," and any(DECIMAL_COMMA.fullmatch(cell) for _, cells in body for cell in cells)
    columns = {name: _with_points([cells[name] for _, cells in read], commas) for name in places}
    read = [(line, {name: columns[name][n] for name in places}) for n, (line, _) in enumerate(read)]
    return ReadTable(path, {name: titles[place] for name, place in places.items()}, read, comments)


def columns_of(
    titles: Sequence[str], required: Mapping[str, str], optional: Mapping[str, str], table: str
) -> dict[str, int]:
    """Numbers of the wanted columns by their names; arguments as of `read_table`.

    Args:
        titles: Of all columns.
        required: Of columns that must be there.
        optional: Of columns that may be there.
        table: Name of the table in messages.

    Raises:
        UserError: If a column is missing or there twice.
    """
    places = _places(titles, {**required, **optional})
    for name, found in places.items():
        if not found and name in required:
            may = f" and may name {', '.join(optional)}" if optional else ""
            listed = ", ".join(repr(title[:30]) for title in titles[:MOST_TITLES])
            rest = f" and {len(titles) - MOST_TITLES} more" if len(titles) > MOST_TITLES else ""
            raise UserError(
                f"{table} has no column {name}; the header must name {', '.join(required)}{may}; it "
                + (f"names {listed}{rest}" if titles else "is empty")
            )
        if len(found) > 1:
            both = " and ".join(repr(titles[place]) for place in found[:2])
            raise UserError(f"{table} has the column {name} twice, {both}; keep one")
    return {name: found[0] for name, found in places.items() if found}


def read_number(text: str) -> float:
    """The number that a cell holds; NaN where it holds none."""
    try:
        return float(text if "_" not in text else "nan")  # Python reads 2_0 as 20
    except ValueError:
        return float("nan")


def _text(path: Path, what: str) -> str:
    """The text of a file in UTF-8 or, as spreadsheets write it, UTF-16 or Windows' Latin letters."""
    try:
        content = path.read_bytes()
        if content.startswith((b"\xff\xfe", b"\xfe\xff")):
            return content.decode("utf-16")
        if b"\0" not in content:
            try:
                return content.decode("utf-8-sig")
            except UnicodeDecodeError:
                return content.decode("cp1252")
    except OSError as error:
        raise UserError(f"cannot read the {what} {path}: {error.strerror}") from None
    except UnicodeDecodeError:
        pass
    raise UserError(f"cannot read the {what} {path}: it is not a CSV file")


def _rows(text: str, separator: str) -> tuple[list[tuple[int, list[str]]], list[str]]:
    """Rows of cells with the numbers of their last lines, and comments."""
    comments: list[str] = []

    def uncommented() -> Iterator[str]:
        for line in StringIO(text, newline=""):
            if comment := line.lstrip().startswith("#"):
                comments.append(line)
            yield "\n" if comment else line

    reader = csv.reader(uncommented(), delimiter=separator, strict=True, skipinitialspace=True)
    rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
    quoted = [" ".join(cells[0].split()) for _, cells in rows if cells and cells[0].startswith("#")]
    table = [(line, cells) for line, cells in rows if any(cells) and not cells[0].startswith("#")]
    return table, [comment.strip(" \t\r\n,;") for comment in comments + quoted]


def _places(titles: Sequence[str], columns: Mapping[str, str]) -> dict[str, list[int]]:
    return {
        name: [place for place, title in enumerate(titles) if re.fullmatch(pattern, title, re.I)]
        for name, pattern in columns.items()
    }


def _with_points(column: list[str], commas: bool) -> list[str]:
    """A column's cells, their numbers with a decimal point; without marks where those part thousands."""
    marked = [cell for cell in column if "," in cell or "." in cell]
    whole = all(map(THOUSANDS.fullmatch, marked)) and any(map(WHOLE.fullmatch, column))
    if not whole and (not commas or any(map(POINT.fullmatch, marked))):
        return column
    number, point = re.compile(f"{DECIMAL_COMMA.pattern}|{THOUSANDS.pattern}", re.I), "" if whole else "."
    return [c.replace(".", "").replace(",", point) if number.fullmatch(c) else c for c in column]


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
        title=shown(title) or None,
        caption=caption or None,
        box=SIMPLE_HEAD,
        title_justify="left",
        caption_justify="left",
        padding=0 if narrow else (0, 1),
        pad_edge=not narrow,
    )
    for heading in headings:
        table.add_column(shown(heading), justify="left" if heading in left else "right")
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


def percent(share: float, digits: int = 3, *, sign: bool = True, plus: bool = False) -> str:
    """A share in per cent, beyond `MANY_TIMES` in times: significant digits, at least all before the point.

    A dash for a share that is not finite.

    Args:
        share: 0.123 is 12.3 %, and 24 is 24 times.
        digits: How many significant digits.
        sign: Whether the per cent sign follows, after a no-break space.
        plus: Whether a positive share has a plus: an error with a direction.
    """
    if not isfinite(share):
        return NONE
    value, ahead = 100 * share, "+" * (plus and share > 0)
    if abs(share) > MANY_TIMES:
        return f"{ahead}{share:.0f}\N{NO-BREAK SPACE}times".replace("-", "−")
    if value == 0:
        text = "0"
    elif abs(value) < LEAST_PERCENT:
        text = f"{'>' if value < 0 else '<'}\N{NO-BREAK SPACE}{'−' * (value < 0)}{LEAST_PERCENT}"
    else:
        text = f"{value:.0f}".replace("-", "−") if abs(value) >= 10**digits else number(value, digits)
    return f"{ahead}{text}\N{NO-BREAK SPACE}%" if sign else f"{ahead}{text}"


def distance(value: float) -> str:
    """A small length, mm, with two significant digits; a dash for NaN, zero for rounding errors."""
    if isnan(value):
        return NONE
    if value > 1e-9 and value < LEAST_DISTANCE:
        return f"<\N{NO-BREAK SPACE}{LEAST_DISTANCE}"
    return f"{value if value > 1e-9 else 0:.2g}"

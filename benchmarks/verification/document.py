"""The tables of docs/verification.md, from the measured cases; less than a minute."""

from collections.abc import Sequence

from rich.table import Table

from benchmarks.tables import DOCS, cells_of, fill, markdown
from benchmarks.verification.cases import CASES
from benchmarks.verification.record import Case
from pinnray.runtime.errors import UserError
from pinnray.runtime.tables import terminal_table

PAGE = DOCS / "verification.md"
OVERVIEW = ("case", "answer", "elements", "plane states", "numbers", "")
NUMBERS = ("element", "plane", "quantity", "measured", "expected", "")


def main() -> Table:
    """Measure every case, fill the page and return its overview.

    Raises:
        UserError: If a number is out of its bounds.
    """
    for name, table in tables(CASES).items():
        fill(PAGE, name, table)
    missed = [
        f"{case.name}: P{row.degree}, {row.plane}: {row.quantity}: {row.shown}, not {row.expected.words}"
        for case in CASES
        if case.available
        for row in case.rows()
        if not row.passed
    ]
    if missed:
        raise UserError("; ".join(missed))
    return terminal_table("Verification", OVERVIEW, cells_of(PAGE, "overview"), left=OVERVIEW)


def tables(cases: Sequence[Case]) -> dict[str, str]:
    """Tables of the page by their marks; that of a case whose program is not installed stays."""
    kept = {cells[0].partition("]")[0][1:]: cells for cells in cells_of(PAGE, "overview")}
    overview = [summary(case) if case.available else kept[case.name] for case in cases]
    return {"overview": markdown(OVERVIEW, overview, left=len(OVERVIEW))} | {
        case.name: numbers(case) for case in cases if case.available
    }


def summary(case: Case) -> list[str]:
    """A case's line of the overview."""
    rows = case.rows()
    elements = ", ".join(f"P{degree}" for degree in sorted({row.degree for row in rows}))
    planes = ", ".join(sorted({row.plane for row in rows}))
    passed = sum(row.passed for row in rows)
    anchor = "".join(letter for letter in case.name.lower() if letter.isalnum() or letter in " -")
    link = f"[{case.name}](#{anchor.replace(' ', '-')})"
    return [link, case.answer, elements, planes, str(len(rows)), mark(passed == len(rows))]


def numbers(case: Case) -> str:
    """A case's numbers beside their bounds."""
    rows = [
        (f"P{row.degree}", row.plane, row.quantity, row.shown, row.expected.words, mark(row.passed))
        for row in case.rows()
    ]
    return markdown(NUMBERS, rows, left=len(NUMBERS))


def mark(passed: bool) -> str:
    """The sign of a number within its bounds."""
    return "✓" if passed else "✗"

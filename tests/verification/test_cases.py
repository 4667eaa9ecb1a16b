"""Every case of verification, and the page that shows them."""

import re

import pytest

from benchmarks.tables import cells_of, table_of
from benchmarks.verification.cases import CASES
from benchmarks.verification.document import PAGE, numbers, summary
from benchmarks.verification.record import Case

DEAR = ("another program", "three dimensions", "cylinder with friction", "finite strain")


def marked(case: Case):
    return pytest.param(
        case, marks=pytest.mark.release if case.name in DEAR else pytest.mark.slow, id=case.name
    )


def without_digits(text: str) -> str:
    """All but the last digits of the numbers, which differ from machine to machine."""
    return re.sub(r"\| (below 1e-\d+|[\d.]+(e-\d+)?( \(error [\d.e-]+\))?) \|", "| number |", text)


@pytest.mark.parametrize("case", map(marked, CASES))
def test_numbers_are_what_they_have_to_be_and_on_the_page(case):
    if not case.available:
        pytest.skip(f"{case.needs} is not installed")
    assert [row for row in case.rows() if not row.passed] == []
    assert summary(case) in cells_of(PAGE, "overview")
    assert without_digits(table_of(PAGE, case.name)) == without_digits(numbers(case))


def test_the_page_has_the_cases_in_their_order_each_with_its_source():
    listed = [cells[0].partition("]")[0][1:] for cells in cells_of(PAGE, "overview")]
    sections = PAGE.read_text(encoding="utf-8").split("\n## ")[1:]
    assert listed == [case.name for case in CASES]
    for case, section in zip(CASES, sections, strict=False):
        assert section.startswith(f"{case.name[0].upper()}{case.name[1:]}\n\n")
        assert "\n\nSource: " in section.partition(f"\n<!-- {case.name} -->\n")[0]

"""Every case of verification, and the page that shows them."""

import re

import pytest

from benchmarks.tables import table_of
from benchmarks.verification.cases import CASES
from benchmarks.verification.document import PAGE, tables

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_numbers_are_what_they_have_to_be(case):
    if not case.available:
        pytest.skip(f"{case.needs} is not installed")
    assert [row for row in case.rows() if not row.passed] == []


def test_the_page_is_what_the_command_writes():
    """All but the last digits of the numbers, which differ from machine to machine."""

    def without_digits(text: str) -> str:
        return re.sub(r"\| (below 1e-\d+|[\d.]+(e-\d+)?( \(error [\d.e-]+\))?) \|", "| number |", text)

    for name, table in tables(CASES).items():
        assert without_digits(table_of(PAGE, name)) == without_digits(table)

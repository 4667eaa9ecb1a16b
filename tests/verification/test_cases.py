"""Every case of verification, and the page that shows them."""

import re

import pytest

from benchmarks.verification.cases import CASES
from benchmarks.verification.document import PAGE, page

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

    text = PAGE.read_text(encoding="utf-8")
    assert without_digits(text) == without_digits(page(CASES, text))

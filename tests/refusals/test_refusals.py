"""Every approved input is refused by its approved line; see `runner`."""

import pytest

from tests.refusals.runner import Refusal, refusals, refused


@pytest.mark.parametrize("refusal", refusals(), ids=lambda refusal: f"{refusal.section}: {refusal.given}")
def test_an_input_is_refused_by_its_approved_line(refusal: Refusal, tmp_path):
    line = refused(refusal, tmp_path)
    assert refusal.matches(line), f"{line}\nis not the approved line:\n{refusal.line}"


def test_no_input_is_approved_twice():
    given = [(refusal.section, refusal.given) for refusal in refusals()]
    assert sorted({each for each in given if given.count(each) > 1}) == []

"""Random fingers, materials and loads: a valid result or one line; the benchmark `reliability` has more."""

import pytest

from benchmarks.reliability.inputs import tried


@pytest.mark.usefixtures("few_elements")
def test_random_input_gives_a_result_or_one_line() -> None:
    found = tried(24)
    assert not found.wrong
    assert found.states["done"] >= 2

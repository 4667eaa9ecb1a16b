"""Random fingers, loads and drawings: a valid result or one line; the same commands try more."""

import pytest

from benchmarks.reliability import drawings, inputs


@pytest.mark.slow
@pytest.mark.usefixtures("few_elements")
def test_random_input_gives_a_result_or_one_line() -> None:
    states, wrong = inputs.tried(20)
    assert not wrong
    assert states["done"] >= 2


@pytest.mark.slow
def test_random_drawings_are_read_as_they_were_drawn() -> None:
    """To 1e-6 of their area."""
    counts, wrong = drawings.tried(12)
    assert not wrong
    right = ("read", "read as proposed", "depth asked for")
    assert sum(number for (_, state), number in counts.items() if state in right) >= 10
    assert {kind.split()[0] for kind, state in counts if state == "read"} == {"dxf", "svg", "step"}

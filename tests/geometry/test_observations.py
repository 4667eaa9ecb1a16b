"""The origin of observations."""

import pytest

from tests.refusals.geometry import observations


@pytest.mark.parametrize(("simulated", "label"), [(True, "simulated"), (False, "measured")])
def test_label_says_where_the_numbers_come_from(simulated: bool, label: str) -> None:
    found = observations(simulated=simulated)
    assert found.known
    assert found.label == label


def test_markers_that_nobody_saw_are_unknown() -> None:
    hidden = observations(visible=[False] * 3)
    assert not hidden.known
    assert hidden.label == "unknown"

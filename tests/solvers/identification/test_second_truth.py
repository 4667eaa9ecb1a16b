"""The force from markers of a truth written apart from the program; see tests/data/second-renderer."""

from pathlib import Path

import pytest

import pinnray as pr
from solvers.problem import Load

DATA = Path(__file__).parents[2] / "data" / "second-renderer"
FORCE = 0.2535


def identified(measurements):
    """By `fem-id`, on coarse elements."""
    finger = pr.load_design("default").model_copy(update={"contact_position": 36.5})
    load = Load(displacement=(0.0, -9.5))
    return pr.solve(finger, "fem-id", size=2.0, load=load, measurements=DATA / measurements)


@pytest.mark.slow
@pytest.mark.usefixtures("few_elements")
def test_one_wrong_marker_makes_no_wrong_law_certain():
    """Laws were compared by fits that had not converged: the wrong one had all of the probability, +20 %."""
    found = identified("one-marker-off.csv")
    assert found.stats["force"] == pytest.approx(FORCE, rel=0.05)
    assert found.stats["force_low"] < FORCE < found.stats["force_high"]
    assert found.stats["probability neo-hookean"] > 0.3
    assert found.stats["doubtful_markers"] == 1


@pytest.mark.slow
def test_noise_alone_chooses_no_law_that_no_polymer_follows():
    """With prior odds of 3 to 1 neo-Hookean would have 35 %, and the force would be 6.6 % off."""
    found = identified("gap.csv")
    assert found.stats["probability neo-hookean"] > 0.9
    assert found.stats["force"] == pytest.approx(FORCE, rel=0.05)
    assert found.stats["force_low"] < FORCE < found.stats["force_high"]

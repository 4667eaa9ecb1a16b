"""The force from markers of a truth written apart from the program; see tests/data/second-renderer."""

from pathlib import Path

import pytest

import pinnray as pr
from solvers.problem import Load

DATA = Path(__file__).parents[2] / "data" / "second-renderer"
FORCE = 0.2535


@pytest.mark.slow
def test_one_wrong_marker_makes_no_wrong_law_certain():
    """Laws were compared by fits that had not converged: the wrong one had all of the probability, +20 %."""
    finger = pr.load_design("default").model_copy(update={"contact_position": 36.5})
    found = pr.solve(
        finger,
        "fem-id",
        size=2.0,
        load=Load(displacement=(0.0, -9.5)),
        measurements=DATA / "one-marker-off.csv",
    )
    assert found.stats["force"] == pytest.approx(FORCE, rel=0.05)
    assert found.stats["force_low"] < FORCE < found.stats["force_high"]
    assert found.stats["probability neo-hookean"] > 0.3
    assert found.stats["doubtful_markers"] == 1

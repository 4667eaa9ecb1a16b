"""Real fingers with points clicked in two photographs; see tests/data/printed-fingers."""

from pathlib import Path

import numpy as np
import pytest

import pinnray as pr
from solvers.problem import Load

DATA = Path(__file__).parents[2] / "data" / "printed-fingers"


@pytest.mark.slow
@pytest.mark.parametrize(("name", "stroke"), [("A", 16.0), ("B", 18.0)])
def test_mechanics_predict_a_real_finger_better_than_none(name, stroke):
    """Nothing is set by hand: the pressed picture, whose turn nobody knows, is an unknown of every solver."""
    finger, load = pr.load_drawing(DATA / f"{name}.svg"), Load(displacement=(0.0, -stroke))

    def left_out(solver: str) -> float:
        """Root mean square of the held-out errors of u and v, mm."""
        found = pr.solve(finger, solver, size=1.0, load=load, measurements=DATA / f"{name}.csv")
        assert found.left_out is not None
        return float(np.sqrt(((found.left_out - found.problem.observations.displacements) ** 2).mean()))

    rivals = min(left_out("gp"), left_out("statfem"))
    # `pinn-id` takes a minute for A.
    for solver in ("fem-id", "pinn-id") if name == "B" else ("fem-id",):
        best = left_out(solver)
        assert best < 0.45
        assert best < 0.8 * rivals

"""Strain, stress and energy density from the displacement gradient of any solution."""

from typing import get_args

import numpy as np
import pytest

from solvers.elasticity import LawName
from solvers.problem import Material, Problem
from solvers.solution import State


@pytest.mark.parametrize("law", get_args(LawName))
@pytest.mark.parametrize("angle", [0.1, 1.0, 3.0])
def test_rigid_motion_has_no_stress(coarse_mesh, law, angle):
    """A rotation is infinitesimal for a linear law; the base is clamped, so that no solver can make one."""
    sine, cosine = np.sin(angle), np.cos(angle)
    rotation = [[0, -angle], [angle, 0]] if law == "linear" else [[cosine - 1, -sine], [sine, cosine - 1]]
    state = State.from_gradient(np.array([rotation]), Problem(coarse_mesh, Material(law=law)))
    assert np.abs(state.stress).max() < 1e-12
    assert np.abs(state.stress_zz).max() < 1e-12
    assert np.abs(state.energy_density).max() < 1e-12

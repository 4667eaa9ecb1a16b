"""A solver's own error beside every difference from it."""

import numpy as np
import pytest


def test_it_is_the_difference_of_the_improved_solution(estimated):
    """One per cent more of everything; the energy falls by the square."""
    own = estimated.uncertainty
    assert own is not None
    assert own.displacement.rel_l2 == pytest.approx(0.01)
    assert own.von_mises.rel_l2 == pytest.approx(0.01)
    assert own.stress["xy"].rel_l2 == pytest.approx(0.01)
    assert own.rel_energy == pytest.approx(-1e-4)
    assert estimated.marker_uncertainty is not None
    np.testing.assert_allclose(estimated.marker_uncertainty, 0.01 * np.abs(estimated.marker_displacement))
    assert own.mae_markers == pytest.approx(estimated.marker_uncertainty.sum(axis=1).mean())

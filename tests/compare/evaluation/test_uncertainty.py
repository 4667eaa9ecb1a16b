"""A solver's own error beside every difference from it."""

import numpy as np
import pytest

from pinnray.comparison.evaluation.metrics import indistinct, reference_differences


def test_it_is_the_difference_of_the_improved_solution(estimated):
    """One per cent more of everything; the energy falls by the square."""
    own = estimated.uncertainty
    assert own is not None
    assert own.displacement.rel_l2 == pytest.approx(0.01)
    assert own.von_mises.rel_l2 == pytest.approx(0.01)
    assert own.stress["xy"].rel_l2 == pytest.approx(0.01)
    assert own.energy == pytest.approx(-1e-4)
    assert estimated.marker_uncertainty is not None
    np.testing.assert_allclose(estimated.marker_uncertainty, 0.01 * np.abs(estimated.marker_displacement))
    assert own.mae_markers == pytest.approx(estimated.marker_uncertainty.sum(axis=1).mean())


@pytest.mark.parametrize(
    ("scale", "expected"),
    [
        # the energy of the evaluations is 2 scale^2, its error 1e-4 of it
        (1.00004, ["displacement", "von Mises stress", "energy", "displacement of the markers"]),
        (1.005, ["displacement", "von Mises stress", "displacement of the markers"]),
        (1.02, []),
    ],
)
def test_what_is_smaller_than_the_own_error_is_named(evaluate, estimated, scale, expected):
    differences = reference_differences(evaluate("pinn-std", scale), estimated)
    assert indistinct(differences, estimated.uncertainty) == expected
    assert indistinct(differences, None) == []

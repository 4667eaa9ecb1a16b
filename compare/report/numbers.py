"""The numbers of a report as text: one rounding for each kind, so that none stands there in two.

Stresses, displacements and forces have the three digits of `number(value, 3)`.
"""

from math import isfinite, isnan

from pinnray.comparison.evaluation.scores import SolverScores
from pinnray.runtime.tables import NONE, percent


def share(value: float) -> str:
    """A relative difference, with two digits."""
    return percent(value, 2)


def error(value: float) -> str:
    """A relative error with its sign, with two digits."""
    return percent(value, 2, plus=True)


def at_markers(value: float) -> str:
    """A mean error at markers, mm, to 0.001."""
    return NONE if isnan(value) else f"{value:.3f}"


def seconds(own: SolverScores) -> str:
    """Time of the solve, s, or a dash if it is not recorded."""
    value = own.seconds
    return f"{value:.{2 if value < 10 else 1 if value < 100 else 0}f}" if isfinite(value) else NONE


def truth_errors(own: SolverScores) -> list[str]:
    """Distances from the simulated finger in displacement, stress and force; none if there is no such."""
    if own.to_truth is None:
        return []
    found = own.to_truth
    return [share(found.displacement.rel_l2), share(found.von_mises.rel_l2), error(own.force_to_truth_rel)]

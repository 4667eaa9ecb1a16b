"""The numbers of a report as text: one rounding for each kind, so that none stands there in two.

Stresses, displacements and forces have the three digits of `number(value, 3)`.
"""

from math import isfinite, isnan

from pinnray.comparison.evaluation.scores import SolverScores
from pinnray.runtime.tables import NONE, number, percent

LARGEST = 10.0
"""Relative differences from this on are told as a multiple."""


def share(value: float) -> str:
    """A relative difference: in per cent with two digits, or as `22 times`."""
    return percent(value, 2) if not abs(value) >= LARGEST else f"{number(value, 2)} times"


def error(value: float) -> str:
    """A relative error with its sign; one of ten times or more as the multiple of what is right."""
    if abs(value) >= LARGEST:
        return share(1 + value)
    return f"{'+' if value > 0 else ''}{share(value)}"


def at_markers(value: float) -> str:
    """A mean error at markers, mm, to 0.001."""
    return NONE if isnan(value) else f"{value:.3f}"


def seconds(own: SolverScores) -> str:
    """Time of the solve, s, or a dash if it is not recorded."""
    value = own.seconds
    return f"{value:.{2 if value < 10 else 1 if value < 100 else 0}f}" if isfinite(value) else NONE

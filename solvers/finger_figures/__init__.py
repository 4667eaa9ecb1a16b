"""Figures of a finger under its load, in its designer's units: force, tip, wrap, stress, compliance, mass."""

from pinnray.solvers.finger_figures.figures import (
    FRACTIONS,
    QUANTITIES,
    FingerFigures,
    Quantity,
    break_warning,
    figures_at_rest,
    figures_of,
    heading,
)

__all__ = [
    "FRACTIONS",
    "QUANTITIES",
    "FingerFigures",
    "Quantity",
    "break_warning",
    "figures_at_rest",
    "figures_of",
    "heading",
]

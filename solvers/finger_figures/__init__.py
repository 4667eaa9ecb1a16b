"""Figures of a finger under its load, in its designer's units: force, tip, wrap, stress, compliance, mass."""

from pinnray.solvers.finger_figures.figures import (
    QUANTITIES,
    FingerFigures,
    Quantity,
    break_answer,
    figures_at_rest,
    figures_of,
    heading,
)

__all__ = [
    "QUANTITIES",
    "FingerFigures",
    "Quantity",
    "break_answer",
    "figures_at_rest",
    "figures_of",
    "heading",
]

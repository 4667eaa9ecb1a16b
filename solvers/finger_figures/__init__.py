"""Figures of a finger under its load, in its designer's units: force, tip, wrap, stress, compliance, mass."""

from pinnray.solvers.finger_figures.figures import (
    NEAR_BREAK,
    QUANTITIES,
    FingerFigures,
    Quantity,
    break_answer,
    figures_at_rest,
    figures_of,
    heading,
)

__all__ = [
    "NEAR_BREAK",
    "QUANTITIES",
    "FingerFigures",
    "Quantity",
    "break_answer",
    "figures_at_rest",
    "figures_of",
    "heading",
]

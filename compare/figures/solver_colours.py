"""The colour of a solver, the same in every chart."""

SOLVER_COLOURS = (
    "#0072b2",
    "#e69f00",
    "#009e73",
    "#56b4e9",
    "#d55e00",
    "#000000",
    "#8c6bb1",
    "#999933",
    "#8c510a",
)
"""Okabe and Ito's palette, safe for colour-blind readers, without its pink (see `MEASURED`), and more."""


def solver_colour(number: int) -> str:
    """Colour of the solver with that number in the run's order."""
    return SOLVER_COLOURS[number % len(SOLVER_COLOURS)]

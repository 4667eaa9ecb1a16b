"""The force of the indenter and its place over time, with their intervals."""

import numpy as np

from compare.figures.style import axes_at, heading, solver_colour
from geometry.arrays import FloatArray
from geometry.figure import WIDTH, Figure, figure

HEAD, HEIGHT, GAP, FOOT, LEFT, RIGHT = 0.5, 1.9, 0.25, 0.45, 0.75, 0.15
"""Heights and the margins, inches."""
LOW = 0.1
"""Share of the largest force below which its place is not drawn: it is hardly known there."""


def draw_force_track(times: FloatArray, forces: FloatArray, places: FloatArray, *, depth: float) -> Figure:
    """Draw the force, and its place where there is one, over time.

    Args:
        times: Shape (f,), s.
        forces: Force and the ends of its interval, shape (f, 3), N; nan and inf where it is not known.
        places: The same for the abscissa of the contact, mm.
        depth: Of the finger, mm.
    """
    known = np.isfinite(forces).all(axis=1)
    top = float(forces[known, 2].max(initial=0.0)) or 1.0
    pressed = known & (forces[:, 0] > LOW * forces[known, 0].max(initial=0.0))
    with figure(HEAD + 2 * HEIGHT + GAP + FOOT) as drawn:
        heading(
            drawn,
            "Force of the indenter, by the markers",
            f"for a depth of {depth:g} mm; bands: intervals of 95 %",
        )
        first, second = (
            axes_at(drawn, (LEFT, HEAD + number * (HEIGHT + GAP), WIDTH - LEFT - RIGHT, HEIGHT))
            for number in range(2)
        )
        for axes, values, shown, label in (
            (first, forces, known, "force, N"),
            (second, places, pressed, "contact, x in mm"),
        ):
            value, low, high = np.where(shown[:, None], values, np.nan).T
            axes.fill_between(times, low, high, color=solver_colour(0), alpha=0.25, linewidth=0)
            axes.plot(times, value, color=solver_colour(0), linewidth=1.2)
            axes.set_ylabel(label)
            axes.grid(color="#dddddd", linewidth=0.5)
            axes.set_xlim(float(times.min()), max(float(times.max()), float(times.min()) + 1e-3))
        first.set_ylim(0, 1.05 * top)
        first.tick_params(labelbottom=False)
        second.set_xlabel("time, s")
    return drawn

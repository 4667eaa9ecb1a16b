"""Lines for the terminal with the figures of a finger."""

from collections.abc import Sequence
from math import isnan

from pinnray.solvers.finger_figures import FingerFigures


def figures_lines(figures: FingerFigures, forces: Sequence[tuple[float, float]] = ()) -> list[str]:
    """One solver's figures, a line each, after the forces, N, at some strokes, mm."""
    rows = [
        ("force", "not known" if isnan(force) else f"{force:.4g} N", f"at {stroke:g} mm")
        for stroke, force in forces
    ]
    rows += figures.rows()
    widths = [max(len(row[column]) for row in rows) for column in (0, 1)]
    return [f"{name:<{widths[0]}}  {value:<{widths[1]}}  {remark}".rstrip() for name, value, remark in rows]

"""Errors at the markers, a row a solver."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from compare.evaluation.comparison import Comparison
from compare.evaluation.evaluation import Evaluation
from compare.evaluation.metrics import MarkerErrors, held_out_errors, marker_errors
from compare.figures.style import axes_at, heading, legend_below_heading, solver_colour
from geometry.arrays import BoolArray
from geometry.figure import MUTED, SMALL, WIDTH, Figure, figure
from geometry.observations import Observations

HEAD, TITLE, HEIGHT, GAP, FOOT = 0.62, 0.19, 0.42, 0.09, 0.4
"""Heights in inches: heading and legend; a solver's name; its bars; the space below; the lowest axis."""
LEFT, MEANS = 0.56, 0.82
"""Widths in inches beside the bars: their scale; their means."""


def draw_marker_errors(comparison: Comparison) -> Figure:
    """Bars of |du| and |dv| at every marker (Fig. 6 of the paper), all on one scale.

    Full bars: at markers that the solver was not given. Hollow ones: at markers that it was given.
    """
    evaluations, observations = comparison.evaluations, comparison.observations
    width = WIDTH / 2 - LEFT - MEANS
    step = TITLE + HEIGHT + GAP
    ceiling = _ceiling(evaluations, observations)
    with figure(HEAD + len(evaluations) * step + FOOT) as drawn:
        heading(drawn, f"Absolute error at the markers, against {observations.label} displacements")
        handles = [
            Patch(facecolor=MUTED, edgecolor=MUTED, label="at a marker that the solver was not given"),
            Patch(facecolor="white", edgecolor=MUTED, label="at one that it was given"),
        ]
        legend_below_heading(drawn, handles, length=1.4)
        for row, evaluation in enumerate(evaluations):
            held_out = held_out_errors(evaluation, observations)
            given = marker_errors(evaluation, observations) if evaluation.in_sample else None
            for column, symbol in enumerate("uv"):
                box = (LEFT + column * WIDTH / 2, HEAD + TITLE + row * step, width, HEIGHT)
                axes = axes_at(drawn, box)
                _bars(axes, symbol, held_out, given, solver_colour(row))
                _scales(axes, observations.visible, ceiling)
                axes.set_ylabel(rf"$|\Delta {symbol}|$, mm", size=SMALL)
                if column == 0:
                    axes.set_title(evaluation.label_at_markers, size=8.5, pad=2, weight="bold")
                if row == len(evaluations) - 1:
                    axes.set_xlabel("marker, by its number in the drawing")
                else:
                    axes.tick_params(labelbottom=False)
    return drawn


def _ceiling(evaluations: Sequence[Evaluation], observations: Observations) -> float:
    """The largest error of a solver that converged (or of any), mm."""
    chosen = [evaluation for evaluation in evaluations if evaluation.converged] or evaluations
    errors = [
        error(evaluation, observations) for evaluation in chosen for error in (marker_errors, held_out_errors)
    ]
    found = [np.nanmax([error.ae_u, error.ae_v]) for error in errors if error is not None]
    return float(max(found)) or 1.0


def _bars(
    axes: Axes, symbol: str, held_out: MarkerErrors | None, given: MarkerErrors | None, colour: str
) -> None:
    """The bars of one solver and component, and their means beside."""
    width = 0.8 if held_out is None or given is None else 0.4
    words = []
    for errors, shift, hollow in ((held_out, -0.5, False), (given, 0.5, True)):
        if errors is None:
            continue
        values = getattr(errors, f"ae_{symbol}")
        marker = np.arange(1, len(values) + 1)
        x = marker + (shift * width if width < 0.5 else 0.0)
        seen = np.isfinite(values)
        face = "white" if hollow else colour
        axes.bar(x[seen], values[seen], 0.9 * width, color=face, edgecolor=colour, linewidth=0.6)
        words.append(f"{'given' if hollow else 'mean'} {getattr(errors, f'mae_{symbol}'):.3f}")
    axes.text(1.03, 0.5, "\n".join(words), size=SMALL, va="center", color=MUTED, transform=axes.transAxes)


def _scales(axes: Axes, visible: BoolArray, ceiling: float) -> None:
    count = len(visible)
    for marker in np.flatnonzero(~visible) + 1:
        axes.text(
            marker, 0.04, "×", size=SMALL, color=MUTED, ha="center", transform=axes.get_xaxis_transform()
        )
    axes.set_xticks(range(1, count + 1) if count <= 12 else range(1, count + 1, 5))
    axes.set_xlim(0.4, count + 0.6)
    axes.set_ylim(0, 1.04 * ceiling)
    axes.yaxis.set_major_locator(MaxNLocator(2))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.tick_params(labelsize=SMALL)
    axes.grid(axis="y", color="#dddddd", linewidth=0.5)
    axes.set_axisbelow(True)

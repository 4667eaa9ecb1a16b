"""Charts of solvers: the losses of their training, and their errors at the markers."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, NullLocator

from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.scores import SolverScores
from pinnray.comparison.figures import layout
from pinnray.comparison.figures.solver_colours import solver_look
from pinnray.runtime.arrays import BoolArray
from pinnray.runtime.figure import INK, MUTED, NARROW, SMALL, WIDTH, Figure, figure

HEAD = 0.3
"""Height of the heading, inches."""


def draw_losses(comparison: Results, page: float = WIDTH) -> Figure | None:
    """Draw a chart for each term of the loss, with a line for every solver that has it (Fig. 7 of the paper).

    None without a record.
    """
    trained = [each for each in comparison.evaluations if {"epoch", "PDE"} <= each.history.keys()]
    if not trained:
        return None
    units = {"PDE": "MPa", "BC": "mm²", "ASM": "mm²"}
    terms = [name for name in units if any(name in each.history for each in trained)]
    head = HEAD + layout.legend_height([evaluation.label_at_markers for evaluation in trained], page)
    height, gap, foot, left = 1.15, 0.15, 0.42, 0.85  # inches
    with figure(head + len(terms) * (height + gap) + foot, page) as drawn:
        layout.write_heading(drawn, "Losses, without their weights")
        for row, term in enumerate(terms):
            axes = layout.axes_at(drawn, (left, head + row * (height + gap), page - left - 0.15, height))
            for evaluation in trained:
                if term in evaluation.history:
                    epochs, losses = evaluation.history["epoch"], evaluation.history[term]
                    (colour, mark), label = solver_look(evaluation.solver), evaluation.label_at_markers
                    style: dict[str, Any] = {"marker": mark, "ms": 3.6, "markevery": max(len(losses) // 8, 1)}
                    axes.plot(epochs, losses, color=colour, lw=1, label=label, **style)
            axes.set_yscale("log")
            axes.yaxis.set_major_formatter("{x:g}")
            axes.set_ylabel(f"{term} loss, {units[term]}")
            axes.grid()
            if row == 0:
                layout.legend_above(axes, page)
            if row < len(terms) - 1:
                axes.tick_params(labelbottom=False)
        axes.set_xlabel("epoch")
    return drawn


CIRCLE: dict[str, Any] = {"ls": "", "marker": "o", "ms": 3.2, "mfc": "white", "mew": 0.8}
"""Look of a training error, which is seen even where the error vanishes."""


def draw_marker_errors(comparison: Results, page: float = WIDTH) -> Figure:
    """Bars of |du| and |dv| at every marker (Fig. 6 of the paper), all on one logarithmic scale.

    Bars: at markers that the solver was not given. Circles: at markers that it was given. Beside them are the
    means, if the page, of a width in inches, is not narrow.
    """
    evaluations, observations = comparison.evaluations, comparison.observations
    title, height, gap, foot = 0.24, 0.5, 0.07, 0.4  # inches: a solver's name; its bars; ...
    left, step = 0.72, title + height + gap
    width = page / 2 - left - (1.02 if page > NARROW else 0.1)  # where the means stand
    scores = [comparison.scores[evaluation.solver] for evaluation in evaluations]
    span = _span(scores)
    head = layout.head_height(page, 2) + 0.05
    with figure(head + len(evaluations) * step + foot, page) as drawn:
        layout.write_heading(drawn, f"Absolute error at {observations.label} markers, mm")
        fitted = any(evaluation.in_sample for evaluation in evaluations)
        handles = [
            Patch(facecolor=MUTED, edgecolor=MUTED, label="held out: not given"),
            Line2D([], [], **CIRCLE, color=MUTED, label="training: given (†)"),
        ]
        layout.legend_below_heading(drawn, handles[: 1 + fitted], length=1.4)
        for row, (evaluation, own) in enumerate(zip(evaluations, scores, strict=True)):
            for column, symbol in enumerate("uv"):
                box = (left + column * page / 2, head + title + row * step, width, height)
                axes = layout.axes_at(drawn, box)
                said = _draw_errors(axes, symbol, own, solver_look(evaluation.solver).colour, span[0])
                _set_scales(axes, observations.visible, span)
                axes.set_ylabel(rf"$|\Delta {symbol}|$", size=SMALL)
                beside: dict[str, Any] = {"size": SMALL, "transform": axes.transAxes}
                if page > NARROW:
                    axes.text(1.03, 0.5, said, va="center", color=MUTED, **beside)
                if page > NARROW and row == 0:
                    axes.text(1.03, 1.06, "mean, mm", color=INK, **beside)
                if column == 0:
                    axes.set_title(evaluation.label_at_markers, size=8.5, pad=6, weight="bold")
                if row == len(evaluations) - 1:
                    axes.set_xlabel("marker")
                else:
                    axes.tick_params(labelbottom=False)
    return drawn


DECADES = 4
"""Powers of ten below the largest error at which the scale of errors ends at the latest."""

SMALLEST = 1e-6
"""Errors below this, mm, are those of rounding."""


def _span(scores: Sequence[SolverScores]) -> tuple[float, float]:
    """Powers of ten around the errors of the solvers that converged (or of any), mm."""
    chosen = [own for own in scores if own.converged] or scores
    errors = [each for own in chosen for each in (own.markers, own.held_out) if each is not None]
    found = np.concatenate([np.append(each.ae_u, each.ae_v) for each in errors])
    found = found[np.isfinite(found) & (found > SMALLEST)]
    if not len(found):
        return SMALLEST, 1e3 * SMALLEST
    high = float(np.ceil(np.log10(found.max()) - 1e-9))
    low = max(float(np.floor(np.log10(found.min()))), high - DECADES)
    return 10 ** min(low, high - 1), 10**high


def _draw_errors(axes: Axes, symbol: str, own: SolverScores, colour: str, floor: float) -> str:
    """The bars and circles of one solver and component, none below the floor; and their means in words."""
    words = []
    for errors, kind in ((own.held_out, "held out"), (own.given, "training")):
        if errors is None:
            continue
        values = np.maximum(getattr(errors, f"ae_{symbol}"), floor)  # a scale of powers has no zero
        marker = np.arange(1, len(values) + 1)
        seen = np.isfinite(values)
        if errors is own.given:
            axes.plot(marker[seen], values[seen], **CIRCLE, color=INK, clip_on=False, zorder=3)
        else:
            axes.bar(marker[seen], values[seen], 0.72, color=colour, edgecolor=colour, linewidth=0.6)
        words.append(f"{getattr(errors, f'mae_{symbol}'):.3f} {kind}")
    return "\n".join(words)


def _set_scales(axes: Axes, visible: BoolArray, span: tuple[float, float]) -> None:
    count = len(visible)
    for marker in np.flatnonzero(~visible) + 1:
        place = axes.get_xaxis_transform()
        axes.text(marker, 0.04, "×", size=SMALL, color=MUTED, ha="center", transform=place)
    axes.set_xticks(range(1, count + 1) if count <= 12 else range(1, count + 1, 5))
    axes.set_xlim(0.4, count + 0.6)
    axes.set_ylim(*span)  # first: a scale of powers cannot find limits for bars that are all at one height
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(numticks=4))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter("{x:g}")
    axes.tick_params(labelsize=SMALL)
    axes.grid(axis="y")
    axes.set_axisbelow(True)

"""Bars of the errors at the markers."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from compare.evaluation import Evaluation
from compare.figures.labels import solver_at_markers
from compare.figures.style import (
    MUTED,
    WIDTH,
    axes_at,
    figure,
    heading,
    legend_above,
    legend_height,
    solver_colour,
)
from compare.metrics import marker_errors
from geometry.arrays import BoolArray, FloatArray
from geometry.observations import Observations

HEAD, HEIGHT, FOOT, LEFT = 0.32, 1.45, 0.42, 0.72
"""Heights and the left margin, inches."""


def draw_marker_errors(path: Path, *, evaluations: Sequence[Evaluation], observations: Observations) -> None:
    """Bars of |du| and |dv| at every marker, grouped by marker, one colour a solver (Fig. 6 of the paper)."""
    errors = [marker_errors(evaluation, observations) for evaluation in evaluations]
    names = [solver_at_markers(evaluation) for evaluation in evaluations]
    charts = {
        "u": ([error.ae_u for error in errors], [error.mae_u for error in errors]),
        "v": ([error.ae_v for error in errors], [error.mae_v for error in errors]),
    }
    legends = {
        symbol: [f"{name}, mean {mean:.3g} mm" for name, mean in zip(names, means, strict=True)]
        for symbol, (_, means) in charts.items()
    }
    heights = [legend_height(labels) for labels in legends.values()]
    with figure(path, HEAD + sum(heights) + 2 * (HEIGHT + FOOT)) as drawn:
        heading(drawn, f"Absolute error at the markers, against {observations.label} displacements")
        for row, (symbol, (columns, _)) in enumerate(charts.items()):
            top = HEAD + sum(heights[: row + 1]) + row * (HEIGHT + FOOT)
            axes = axes_at(drawn, (LEFT, top, WIDTH - LEFT - 0.1, HEIGHT))
            _bars(axes, columns, legends[symbol], observations.visible)
            axes.set_ylabel(rf"$|\Delta {symbol}|$, mm")
        axes.set_xlabel("marker (1 is nearest the base)")


def _bars(axes: Axes, columns: Sequence[FloatArray], labels: Sequence[str], visible: BoolArray) -> None:
    count = len(visible)
    width = 0.8 / len(columns)
    for number, (values, label) in enumerate(zip(columns, labels, strict=True)):
        x = np.arange(1, count + 1) + (number - (len(columns) - 1) / 2) * width
        axes.bar(x[visible], values[visible], width * 0.94, color=solver_colour(number), label=label)
    for marker in np.flatnonzero(~visible) + 1:
        axes.text(
            marker,
            0.02,
            "not seen",
            rotation=90,
            size=7,
            color=MUTED,
            ha="center",
            va="bottom",
            transform=axes.get_xaxis_transform(),
        )
    axes.set_xticks(range(1, count + 1) if count <= 20 else range(1, count + 1, 5))
    axes.set_xlim(0.4, count + 0.6)
    axes.yaxis.set_major_formatter("{x:g}")
    axes.grid(axis="y", color="#dddddd", linewidth=0.5)
    axes.set_axisbelow(True)
    ceiling = max(float(np.nanmax(values)) for values in columns) or 1.0
    axes.set_ylim(0, 1.04 * ceiling)
    legend_above(axes)

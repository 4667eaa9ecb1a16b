"""Bars of the errors at the markers."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from compare.evaluation import Evaluation
from compare.figures.labels import solver_label
from compare.figures.style import MUTED, WIDTH, axes_at, figure, heading, solver_colour
from compare.metrics import marker_errors
from geometry.arrays import BoolArray, FloatArray
from geometry.observations import Observations

BAR_LEFT, BAR_HEIGHT = 0.66, 1.45


def draw_marker_errors(path: Path, *, evaluations: Sequence[Evaluation], observations: Observations) -> None:
    """Bars of |du| and |dv| at every marker, grouped by marker, one colour a solver (Fig. 6 of the paper)."""
    errors = [marker_errors(evaluation, observations) for evaluation in evaluations]
    names = [solver_label(evaluation) for evaluation in evaluations]
    head, gap = 0.52, 0.45
    with figure(path, head + 2 * (BAR_HEIGHT + gap) + 0.05) as drawn:
        heading(
            drawn,
            f"Absolute error at the markers, against {observations.label} displacements",
            "marker 1 is nearest the base",
        )
        for row, (symbol, columns, means) in enumerate(
            [
                ("u", [error.ae_u for error in errors], [error.mae_u for error in errors]),
                ("v", [error.ae_v for error in errors], [error.mae_v for error in errors]),
            ]
        ):
            top = head + row * (BAR_HEIGHT + gap)
            axes = axes_at(drawn, (BAR_LEFT, top, WIDTH - BAR_LEFT - 0.1, BAR_HEIGHT))
            labels = [f"{name}, mean {mean:.3g} mm" for name, mean in zip(names, means, strict=True)]
            _bars(axes, columns, labels, observations.visible)
            axes.set_ylabel(rf"$|\Delta {symbol}|$, mm")
        axes.set_xlabel("marker")


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
    axes.ticklabel_format(axis="y", scilimits=(-2, 3), useMathText=True)
    axes.grid(axis="y", color="#dddddd", linewidth=0.5)
    axes.set_axisbelow(True)
    ceiling = max(float(np.nanmax(values)) for values in columns) or 1.0
    axes.set_ylim(0, ceiling * (1.02 + 0.13 * -(-len(labels) // 2)))
    axes.legend(
        loc="upper left",
        ncols=2,
        handlelength=1.0,
        handletextpad=0.5,
        columnspacing=1.2,
        borderaxespad=0.1,
        frameon=True,
        facecolor="white",
        edgecolor="none",
        framealpha=0.85,
    )

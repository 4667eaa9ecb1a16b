"""A grid search as two maps: distance from `fem`, and violation of the boundary conditions."""

from collections.abc import Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.patches import Rectangle

from pinnray.comparison.figures.style import HALO, axes_at, write_heading
from pinnray.runtime.figure import INK, MUTED, SMALL, WIDTH, Figure, figure
from pinnray.studies.gridsearch.training_run import TrainingRun, best_of

HEAD, CELL, FOOT, LEFT, GAP = 0.68, 0.34, 0.5, 0.85, 0.25
"""Heights, the left margin and the gap between the maps, inches."""

SMALLEST = 1e-12
"""Stands for zero on the logarithmic scale of the colours."""


def draw_grid(runs: Sequence[TrainingRun]) -> Figure:
    """Draw both maps over learning rate and weight; the run nearest to `fem` has a frame."""
    weights = sorted({run.point.bc_weight for run in runs})
    height = CELL * len(weights)
    width = (WIDTH - LEFT - GAP - 0.1) / 2
    maps = {
        "Displacement: relative L² to fem, %": "rel_l2_displacement",
        "Violation of base or load, % of stroke": "boundary_violation",
    }
    epochs = max((int(run.measured["epochs"]) for run in runs if run.measured), default=0)
    with figure(HEAD + height + FOOT) as drawn:
        write_heading(
            drawn,
            "Grid search of the paper's networks",
            f"{epochs:,} epochs. The frame marks the run nearest to fem.",
        )
        for column, (title, quantity) in enumerate(maps.items()):
            axes = axes_at(drawn, (LEFT + column * (width + GAP), HEAD, width, height))
            _map(axes, runs, quantity)
            axes.set_title(title, fontsize=8.5)
            axes.set_xlabel("learning rate")
            if column:
                axes.set_yticklabels([])
            else:
                axes.set_ylabel("BC weight\nMPa/mm²")
    return drawn


def _map(axes: Axes, runs: Sequence[TrainingRun], quantity: str) -> None:
    rates = sorted({run.point.learning_rate for run in runs})
    weights = sorted({run.point.bc_weight for run in runs})
    table = np.full((len(weights), len(rates)), np.nan)
    for run in runs:
        x, y = rates.index(run.point.learning_rate), weights.index(run.point.bc_weight)
        words, colour = run.status, MUTED
        if run.measured:
            table[y, x] = max(100 * run.measured[quantity], SMALLEST)
            words, colour = f"{table[y, x]:.3g}", INK
        axes.text(x, y, words, ha="center", va="center", size=SMALL, color=colour, path_effects=HALO)
    if np.isfinite(table).any():
        norm = LogNorm(np.nanmin(table), np.nanmax(table))
        axes.imshow(table, norm=norm, cmap=colormaps["viridis_r"], aspect="auto")
    if best := best_of(runs):
        corner = (rates.index(best.point.learning_rate) - 0.5, weights.index(best.point.bc_weight) - 0.5)
        axes.add_patch(
            Rectangle(
                corner, 1, 1, fill=False, edgecolor=INK, linewidth=1.8, path_effects=HALO, clip_on=False
            )
        )
    axes.set_xlim(-0.5, len(rates) - 0.5)
    axes.set_ylim(-0.5, len(weights) - 0.5)
    axes.set_xticks(range(len(rates)), [f"{rate:g}" for rate in rates])
    axes.set_yticks(range(len(weights)), [f"{weight:g}" for weight in weights])
    axes.tick_params(length=0)

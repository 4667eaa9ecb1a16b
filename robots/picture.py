"""The picture of a score: front faces of the models and of the finite elements under the largest loads."""

from collections.abc import Sequence

import numpy as np

from pinnray.comparison.figures.layout import axes_at, write_heading
from pinnray.comparison.figures.solver_colours import solver_colour
from pinnray.robots.presses import PressedFinger
from pinnray.robots.score import ModelScore
from pinnray.runtime.figure import INK, MUTED, WIDTH, Figure, figure

SHOWN = (0, 2, 4)
"""Places, from the base, whose largest loads are drawn."""


def draw_score(finger: PressedFinger, scores: Sequence[ModelScore]) -> Figure:
    """Draw the front face at rest, by finite elements and by each model, at three loads."""
    mesh = finger.problem.mesh
    edges = mesh.points[mesh.boundary_edges]
    full = list({each.load.place: number for number, each in enumerate(scores[0].presses)}.values())
    chosen = [full[number] for number in SHOWN if number < len(full)]
    moved = np.concatenate([finger.front + each.moved for each in finger.held_out] + [mesh.points])
    (left, low), (right, high) = moved.min(axis=0) - 2, moved.max(axis=0) + 2
    high += finger.radius
    width = (WIDTH - 0.3) / len(chosen)
    height = width * (high - low) / (right - left)
    with figure(height + 0.95) as drawn:
        write_heading(drawn, "Front face under loads that the fit has not seen")
        for column, number in enumerate(chosen):
            axes = axes_at(drawn, (0.15 + column * width, 0.58, width - 0.05, height))
            load = scores[0].presses[number].load
            for ends in edges:
                axes.plot(*ends.T, color=MUTED, lw=0.3)
            around = np.linspace(0, 2 * np.pi, 100)
            circle = load.centre + finger.radius * np.stack([np.cos(around), np.sin(around)], axis=1)
            axes.fill(circle[:, 0], circle[:, 1] - load.travel, color=MUTED, alpha=0.3, lw=0)
            axes.plot(*(finger.front + load.moved).T, color=INK, lw=2.2, label="fem-nonlinear")
            for which, score in enumerate(scores):
                moved = finger.front + score.presses[number].found.moved
                axes.plot(
                    *moved.T, color=solver_colour(which), lw=1.1, ls=("-", "--")[which % 2], label=score.model
                )
            axes.set(xlim=(left, right), ylim=(low, high))
            axes.axis("off")
            axes.set_title(f"x = {load.place:.3g} mm, {load.travel:.3g} mm")
        drawn.legend(*axes.get_legend_handles_labels(), loc="lower center", ncols=3)
    return drawn

"""The beam at rest and under its three loads, with measured and predicted markers."""

import numpy as np

from benchmarks.validation.half_beam import HEIGHT, LENGTH, Deformation
from benchmarks.validation.markers import LOADS, NAMES, NOMINAL, marker_places
from benchmarks.validation.study import Outcome
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.figure import BODY, INK, MEASURED, MUTED, PAGE, Figure, body_figure

SHADES = {"gravity": "#8fc3e3", "load52": "#3f8fc9", "load101": "#08519c"}
"""Outlines, darker with the load."""

SYMBOLS = dict(zip(NAMES[:3], "o^s", strict=True))


def side_view(outcome: Outcome) -> Figure:
    """Side view of a prediction."""
    visible = np.array([(-LENGTH - 4, -25), (7, 38)], dtype=float)
    title = "Silicone beam under its own weight and two tip loads"
    with body_figure(visible, title, foot=0.62, page=PAGE) as (drawn, axes):
        axes.set_ylabel("z, mm")
        rest = np.array([(-LENGTH, 0), (0, 0), (0, HEIGHT), (-LENGTH, HEIGHT)])
        axes.fill(*rest.T, facecolor=BODY, edgecolor=MUTED, lw=0.6, ls=(0, (3, 2)), zorder=1)
        clamp = np.array([(0, -6), (0, HEIGHT + 6), (-4, HEIGHT + 6), (-4, -6)]) - [LENGTH, 0]
        axes.fill(*clamp.T, facecolor="white", edgecolor=INK, lw=0.6, hatch="/////", zorder=2)
        for case, colour in SHADES.items():
            name = f"and {LOADS[case]:.2f} N at the tip" if LOADS[case] else "under its own weight"
            around = outline(outcome.deformations[case])
            axes.plot(*around.T, color=colour, lw=1.2, label=name, zorder=3)
            for symbol, place, repeats in zip(
                SYMBOLS.values(),
                marker_places(outcome.deformations[case]),
                outcome.measured[case].swapaxes(0, 1),
                strict=True,
            ):
                axes.plot(*repeats[:, [0, 2]].T, symbol, color=MEASURED, ms=3.8, mew=0, zorder=4)
                axes.plot(*place[[0, 2]], symbol, mfc="none", mec=INK, ms=4.6, mew=0.8, zorder=5)
        for (name, symbol), place in zip(SYMBOLS.items(), NOMINAL[:3], strict=True):
            axes.plot(*place[[0, 2]], symbol, mfc="none", mec=MUTED, ms=3.8, mew=0.6, zorder=2)
            axes.plot([], [], symbol, mfc="none", mec=INK, ms=4.6, mew=0.8, label=f"{name}, predicted")
        axes.plot([], [], "o", color=MEASURED, ms=3.8, mew=0, label="measured, two films")
        axes.plot([], [], "o", mfc="none", mec=MUTED, ms=3.8, mew=0.6, label="on the straight beam")
        drawn.legend(*axes.get_legend_handles_labels(), loc="lower center", ncols=3, columnspacing=1.8)
    return drawn


def outline(deformation: Deformation) -> FloatArray:
    """Outline of the deformed side face, from the clamp's lower end round the tip, shape (n, 2): x, z, mm."""
    x, y, z = deformation.nodes.T
    edges = ((np.isclose(z, 0), x), (np.isclose(x, 0), z), (np.isclose(z, HEIGHT), -x))
    moved = deformation.nodes + deformation.displacement
    parts = []
    for on_edge, order in edges:
        chosen = np.flatnonzero(on_edge & np.isclose(y, 0))
        parts.append(moved[chosen[np.argsort(order[chosen])]][:, [0, 2]])
    return np.concatenate(parts)

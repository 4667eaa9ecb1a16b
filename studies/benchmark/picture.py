"""The picture of the benchmark: accuracy over cost, with the front."""

from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter

from pinnray.comparison.figures.layout import HALO, LEGEND_LINE, write_heading
from pinnray.comparison.figures.solver_colours import LOOKS, Look
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.figure import MUTED, WIDTH, Figure, figure
from pinnray.runtime.tables import significant
from pinnray.studies.benchmark.benchmark import Benchmark
from pinnray.studies.optimum.front import unbeaten

SHOWN = {"displacement": "displacement error, %", "von_mises_away": "stress error away\nfrom corners, %"}
COLUMNS = 3
"""Of the legend."""
MARKS = "s*dH8PX<"
"""Of solvers without a colour of their own."""
BESIDE = 12.0
"""Distance of points below which they have one label, pt."""


def draw_accuracy(found: Benchmark, page: float = WIDTH) -> Figure:
    """Median errors of each entry over its median time; a column of panels for each law."""
    labels, medians = [each.label for each in found.entries], found.medians()
    foot = 0.6 + LEGEND_LINE * -(-len(labels) // COLUMNS)
    height = 0.75 + 2.1 * len(SHOWN) + foot
    room = {"left": 0.75 / page, "right": 1 - 0.1 / page, "top": 1 - 0.7 / height, "bottom": foot / height}
    marks = cycle(MARKS)
    looks = {label: LOOKS.get(label.split()[0]) or Look(MUTED, next(marks)) for label in labels}
    with figure(height, page) as drawn:
        write_heading(drawn, "Accuracy over cost", f"{len(found.problems.problems)} problems")
        spaces = {**room, "hspace": 0.12, "wspace": 0.1}
        grid, numbered = drawn.subplots(len(SHOWN), 2, sharex=True, sharey="row", gridspec_kw=spaces), []
        for (name, words), row in zip(SHOWN.items(), grid, strict=True):
            row[0].set_ylabel(words)
            for axes, linear in zip(row, (True, False), strict=True):
                axes.set(xscale="log", yscale="log")
                for axis in (axes.xaxis, axes.yaxis):
                    axis.set_major_formatter(FuncFormatter(lambda value, _: significant(value, 3)))
                    axis.set_minor_formatter(NullFormatter())
                axes.margins(0.12)
                axes.grid(visible=True, which="both", alpha=0.6)
                known = medians[medians.index.get_level_values("linear") == linear].dropna()
                costs = known[["times_fem", name]].to_numpy() * [1.0, 100.0]
                count = sum(each.linear == linear for each in found.problems.problems)
                whole, sure = (known[["solved", "converged"]] == count).to_numpy().T
                best = costs[whole][unbeaten(costs[whole])]
                axes.step(*best[best[:, 0].argsort()].T, where="post", color=MUTED, lw=1.0, zorder=1)
                numbered.append((axes, [labels.index(label) + 1 for label, _ in known.index], costs))
                for (label, _), point, filled in zip(known.index, costs, sure, strict=True):
                    colour, mark = looks[label]
                    axes.plot(*point, mark, color=colour, mfc=colour if filled else "white", ms=5)
        for each in numbered:  # at the last limits of the axes
            _write_numbers(*each)
        for top, bottom, law in zip(grid[0], grid[-1], ("linear", "finite strain"), strict=True):
            top.set_title(law)
            bottom.set_xlabel("time, multiples of fem's")
        handles = [
            Line2D([], [], marker=mark, color=colour, ls="none", label=f"{place} {label}")
            for place, (label, (colour, mark)) in enumerate(looks.items(), start=1)
        ]
        drawn.legend(handles=handles, loc="lower left", ncols=COLUMNS, handletextpad=0.3)
    return drawn


def _write_numbers(axes: Axes, numbers: list[int], points: FloatArray) -> None:
    """Write a number beside each point (n, 2); points side by side have one label, above them."""
    places = axes.transData.transform(points) * 72 / axes.figure.dpi
    left = list(np.argsort(places[:, 0])) if len(points) else []
    while left:
        group = [left.pop(0)]
        for other in list(left):
            if np.abs(places[other] - places[group[-1]]).max() < BESIDE:
                group.append(other)
                left.remove(other)
        text = ",".join(str(numbers[each]) for each in group)
        first, lowest = group[0], group[int(places[group, 1].argmin())]
        shift = (places[group, 0].mean() - places[first, 0], 4 + np.ptp(places[group, 1]))
        axes.annotate(
            text,
            (points[first, 0], points[lowest, 1]),
            xytext=shift if len(group) > 1 else (4, 3),
            textcoords="offset points",
            ha="center" if len(group) > 1 else "left",
            path_effects=HALO,
        )

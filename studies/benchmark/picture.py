"""The picture of the benchmark: accuracy over cost, with the front."""

from statistics import median

import numpy as np
from matplotlib.ticker import FuncFormatter, NullFormatter

from pinnray.comparison.figures.layout import HALO, LEGEND_LINE, write_heading
from pinnray.comparison.figures.solver_colours import solver_look
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.figure import MUTED, WIDTH, Figure, figure
from pinnray.runtime.tables import significant
from pinnray.studies.benchmark.benchmark import Benchmark
from pinnray.studies.optimum.front import unbeaten

SHOWN = {"displacement": "displacement error, %", "von_mises_away": "stress error away\nfrom corners, %"}
COLUMNS = 3
"""Of the legend."""


def draw_front(found: Benchmark, page: float = WIDTH) -> Figure:
    """Median errors of each entry over its median time; a column of panels for each law."""
    foot = 0.55 + LEGEND_LINE * -(-len(found.entries) // COLUMNS)
    height = 0.75 + 2.1 * len(SHOWN) + foot
    room = {"left": 0.75 / page, "right": 1 - 0.1 / page, "top": 1 - 0.7 / height, "bottom": foot / height}
    with figure(height, page) as drawn:
        write_heading(drawn, "Accuracy over cost", f"{len(found.problems.problems)} problems")
        grid = drawn.subplots(
            len(SHOWN), 2, sharex=True, sharey="row", gridspec_kw={**room, "hspace": 0.12, "wspace": 0.06}
        )
        for (name, words), row in zip(SHOWN.items(), grid, strict=True):
            row[0].set_ylabel(words)
            for axes, linear in zip(row, (True, False), strict=True):
                axes.set(xscale="log", yscale="log")
                for axis in (axes.xaxis, axes.yaxis):
                    axis.set_major_formatter(FuncFormatter(lambda value, _: significant(value, 3)))
                    axis.set_minor_formatter(NullFormatter())
                axes.margins(0.12)
                axes.grid(visible=True, which="both", alpha=0.6)
                places, costs, solved = _points(found, name, linear)
                whole = solved == max(solved, default=0)
                best = costs[whole][unbeaten(costs[whole])]
                axes.step(*best[best[:, 0].argsort()].T, where="post", color=MUTED, lw=1.0, zorder=1)
                for place, point, filled in zip(places, costs, whole, strict=True):
                    colour, mark = solver_look(found.entries[place].label.split()[0])
                    face = colour if filled else "white"
                    label = f"{place + 1} {found.entries[place].label}"
                    axes.plot(*point, mark, color=colour, mfc=face, ms=5, label=label)
                    axes.annotate(
                        str(place + 1), point, (4, 3), textcoords="offset points", path_effects=HALO
                    )
        for axes, law in zip(grid[0], ("linear", "finite strain"), strict=True):
            axes.set_title(law)
        for axes in grid[-1]:
            axes.set_xlabel("time, multiples of fem's")
        named = {
            text: handle
            for axes in grid.flat
            for handle, text in zip(*axes.get_legend_handles_labels(), strict=True)
        }
        order = sorted(named, key=lambda text: int(text.split()[0]))
        drawn.legend(
            [named[text] for text in order], order, loc="lower left", ncols=COLUMNS, handletextpad=0.3
        )
    return drawn


def _points(found: Benchmark, name: str, linear: bool) -> tuple[list[int], FloatArray, IntArray]:
    """Places of p entries, their times and errors, %, shape (p, 2), and how many problems they solved."""
    names = {each.name for each in found.problems.problems if each.linear == linear}
    places, costs, solved = [], [], []
    for place, entry in enumerate(found.entries):
        rows = [row for row in entry.solved.values() if row.problem in names and row.times_fem]
        if rows:
            places.append(place)
            solved.append(len(rows))
            costs.append(
                (
                    median(row.times_fem or 0.0 for row in rows),
                    median(100 * getattr(row, name) for row in rows),
                )
            )
    return places, np.array(costs).reshape(-1, 2), np.array(solved, dtype=np.int64)

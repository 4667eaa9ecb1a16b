"""The picture of the benchmark: accuracy over cost, with the front."""

from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter

from pinnray.comparison.figures.layout import HALO, LEGEND_LINE, write_heading
from pinnray.comparison.figures.solver_colours import solver_look
from pinnray.runtime.figure import MUTED, WIDTH, Figure, figure
from pinnray.runtime.tables import significant
from pinnray.studies.benchmark.benchmark import Benchmark
from pinnray.studies.optimum.front import unbeaten

SHOWN = {"displacement": "displacement error, %", "von_mises_away": "stress error away\nfrom corners, %"}
COLUMNS = 3
"""Of the legend."""


def draw_front(found: Benchmark, page: float = WIDTH) -> Figure:
    """Median errors of each entry over its median time; a column of panels for each law."""
    labels, medians = [each.label for each in found.entries], found.medians()
    foot = 0.6 + LEGEND_LINE * -(-len(labels) // COLUMNS)
    height = 0.75 + 2.1 * len(SHOWN) + foot
    room = {"left": 0.75 / page, "right": 1 - 0.1 / page, "top": 1 - 0.7 / height, "bottom": foot / height}
    looks = {label: solver_look(label.split()[0]) for label in labels}
    with figure(height, page) as drawn:
        write_heading(drawn, "Accuracy over cost", f"{len(found.problems.problems)} problems")
        spaces = {**room, "hspace": 0.12, "wspace": 0.06}
        grid = drawn.subplots(len(SHOWN), 2, sharex=True, sharey="row", gridspec_kw=spaces)
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
                whole = (known["solved"] == known["solved"].max()).to_numpy()
                best = costs[whole][unbeaten(costs[whole])]
                axes.step(*best[best[:, 0].argsort()].T, where="post", color=MUTED, lw=1.0, zorder=1)
                for (label, _), point, filled in zip(known.index, costs, whole, strict=True):
                    colour, mark = looks[label]
                    axes.plot(*point, mark, color=colour, mfc=colour if filled else "white", ms=5)
                    number = str(labels.index(label) + 1)
                    axes.annotate(number, point, (4, 3), textcoords="offset points", path_effects=HALO)
        for top, bottom, law in zip(grid[0], grid[-1], ("linear", "finite strain"), strict=True):
            top.set_title(law)
            bottom.set_xlabel("time, multiples of fem's")
        handles = [
            Line2D([], [], marker=mark, color=colour, ls="none", label=f"{place} {label}")
            for place, (label, (colour, mark)) in enumerate(looks.items(), start=1)
        ]
        drawn.legend(handles=handles, loc="lower left", ncols=COLUMNS, handletextpad=0.3)
    return drawn

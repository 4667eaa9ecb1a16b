"""Charts of a cross-validation: errors at markers, distances from the truth, marker weights."""

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes

from compare.crossval.scores import FIELD_NAMES, Score
from compare.figures.style import (
    LEGEND_LINE,
    SOLVER_COLOURS,
    axes_at,
    heading,
    legend_above,
    legend_height,
    solver_colour,
)
from geometry.figure import WIDTH, Figure, figure

HEAD, HEIGHT, FOOT, LEFT, GAP = 0.5, 2.2, 0.5, 0.72, 0.5
"""Heights, the left margin and the gap between charts, inches."""

SHAPES = "os^Dv"
"""Shapes of the marks: another one when the colours begin again."""

SHIFT = 0.03
"""Horizontal shift of a solver's marks from the previous solver's, so that none hides another."""

SMALLEST = 1e-4
"""Misfit below which nothing is drawn, mm: no camera resolves it."""


def draw_held_out(errors: Mapping[str, Sequence[float]], simulated: bool) -> Figure:
    """Draw the mean of |du| + |dv| at every marker where it is held out, a line for each solver."""
    height = legend_height(list(errors))
    with figure(HEAD + height + HEIGHT + FOOT) as drawn:
        heading(
            drawn,
            "Error of each marker when it is held out",
            f"Mean over seeds, against {'simulated' if simulated else 'measured'} displacements.",
        )
        axes = axes_at(drawn, (LEFT, HEAD + height, WIDTH - LEFT - 0.1, HEIGHT))
        for number, (label, values) in enumerate(errors.items()):
            _line(axes, range(1, len(values) + 1), values, number, label)
        axes.set_xlabel("marker (1 is nearest the base)")
        axes.set_ylabel(r"$|\Delta u| + |\Delta v|$, mm")
        axes.set_xticks(range(1, len(values) + 1))
        _finish(axes)
    return drawn


def draw_fields(scores: Mapping[str, Mapping[str, Score]], schemes: Sequence[str]) -> Figure:
    """Draw relative L2 distances from the truth by scheme, a chart for each field."""
    height = legend_height(list(scores))
    width = (WIDTH - LEFT - 0.1 - (len(FIELD_NAMES) - 1) * GAP) / len(FIELD_NAMES)
    with figure(HEAD + height + HEIGHT + FOOT + 0.25) as drawn:
        heading(
            drawn,
            "Distance from the truth over the body",
            "Relative L², %, by what is held out; the line at 100 % is a field of zero.",
        )
        for column, (name, title) in enumerate(FIELD_NAMES.items()):
            box = (LEFT + column * (width + GAP), HEAD + height, width, HEIGHT)
            axes = axes_at(drawn, box)
            for number, (label, each) in enumerate(scores.items()):
                values = [100 * each[scheme].fields[name].mean for scheme in schemes]
                _line(axes, range(len(schemes)), values, number, label)
            axes.axhline(100, color="#999999", linewidth=0.6, zorder=1)
            axes.set_xticks(range(len(schemes)), schemes, rotation=45, ha="right")
            _finish(axes, legend=column == 0)
            axes.set_xlabel(title)
        drawn.axes[0].set_ylabel("%")
    return drawn


def draw_weight_sweep(sweep: Mapping[str, Sequence[float]]) -> Figure:
    """Draw the errors of `fem-asm` at the markers and over the body against the weight of the markers.

    Args:
        sweep: Columns of `compare.crossval.weight_sweep.sweep_weights`.
    """
    panels: dict[str, dict[str, str]] = {
        "root mean square, mm": {"in_sample_mm": "markers given", "left_out_mm": "each left out"},
        "distance from the truth, %": FIELD_NAMES,
    }
    between, legend = LEFT, len(FIELD_NAMES) * LEGEND_LINE
    width = (WIDTH - LEFT - 0.1 - between) / 2
    with figure(HEAD + legend + HEIGHT + FOOT) as drawn:
        heading(
            drawn,
            "fem-asm for other weights of the markers",
            "All markers given, first seed. Factors of the weight that it has.",
        )
        for column, (label, lines) in enumerate(panels.items()):
            axes = axes_at(drawn, (LEFT + column * (width + between), HEAD + legend, width, HEIGHT))
            for number, (name, title) in enumerate(lines.items()):
                values = [100 * value if column else value for value in sweep[name]]
                axes.plot(sweep["factor"], values, color=solver_colour(number), linewidth=1.2, label=title)
            axes.set_xscale("log")
            axes.set_xlabel("factor of the weight")
            axes.set_ylabel(label)
            _finish(axes, legend=False)
            axes.legend(loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0, labelspacing=0.2)
        drawn.axes[0].set_ylim(bottom=SMALLEST)
        drawn.axes[0].yaxis.set_major_formatter("{x:g}")
    return drawn


def _line(axes: Axes, x: Sequence[float], values: Sequence[float], number: int, label: str) -> None:
    axes.plot(
        [place + SHIFT * number for place in x],
        values,
        color=solver_colour(number),
        marker=SHAPES[number // len(SOLVER_COLOURS) % len(SHAPES)],
        linestyle="-" if number < len(SOLVER_COLOURS) else "--",
        linewidth=0.9,
        markersize=3.5,
        label=label,
    )


def _finish(axes: Axes, *, legend: bool = True) -> None:
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.grid(color="#dddddd", linewidth=0.5)
    axes.set_axisbelow(True)
    if legend:
        legend_above(axes)

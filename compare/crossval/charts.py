"""Charts of a cross-validation: errors at markers, distances from the truth, marker weights."""

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes

from compare.crossval.scores import FIELD_NAMES, Score
from compare.figures.style import (
    LEGEND_LINE,
    SOLVER_COLOURS,
    axes_at,
    legend_above,
    legend_height,
    solver_colour,
    write_heading,
)
from geometry.figure import WIDTH, Figure, figure

HEAD, HEIGHT, FOOT, LEFT, GAP = 0.5, 2.2, 0.5, 0.72, 0.5
"""Heights, the left margin and the gap between charts, inches."""
ROW = HEIGHT + FOOT
"""Height of a row of charts, inches."""

SHAPES = "os^Dv"
"""Shapes of the marks: another one when the colours begin again."""

SHIFT = 0.03
"""Horizontal shift of a solver's marks from the previous solver's, so that none hides another."""

SMALLEST = 1e-4
"""Misfit below which nothing is drawn, mm: no camera resolves it."""


def draw_held_out(errors: Mapping[str, Mapping[str, Sequence[float]]], label: str) -> Figure:
    """Draw the mean of |du| + |dv| at every marker where it is held out: a row a layout, a line a solver.

    Args:
        errors: By layout and solver.
        label: `simulated` or `measured`, of the displacements.
    """
    labels = _labels(errors)
    top = HEAD + legend_height(labels)
    with figure(top + len(errors) * ROW) as drawn:
        write_heading(
            drawn,
            "Error of each marker when it is held out",
            f"Mean over seeds, against {label} displacements.",
        )
        for row, (layout, by_label) in enumerate(errors.items()):
            axes = axes_at(drawn, (LEFT, top + row * ROW, WIDTH - LEFT - 0.1, HEIGHT))
            for label, values in by_label.items():
                _line(axes, range(1, len(values) + 1), values, labels.index(label), label)
            axes.set_xlabel("marker, by its number in the drawing" + _layout_note(errors, layout))
            axes.set_ylabel(r"$|\Delta u| + |\Delta v|$, mm")
            axes.set_xticks(range(1, len(values) + 1))
            _finish(axes, legend=row == 0)
    return drawn


def draw_fields(scores: Mapping[str, Mapping[str, Mapping[str, Score]]], schemes: Sequence[str]) -> Figure:
    """Draw relative L2 distances from the truth by scheme, a row a layout, a chart for each field."""
    labels = _labels(scores)
    top, pitch = HEAD + legend_height(labels), ROW + 0.25
    width = (WIDTH - LEFT - 0.1 - (len(FIELD_NAMES) - 1) * GAP) / len(FIELD_NAMES)
    with figure(top + len(scores) * pitch) as drawn:
        write_heading(
            drawn,
            "Distance from the truth over the body",
            "Relative L², %, by what is held out; the line at 100 % is a field of zero.",
        )
        for row, (layout, by_label) in enumerate(scores.items()):
            for column, (name, title) in enumerate(FIELD_NAMES.items()):
                box = (LEFT + column * (width + GAP), top + row * pitch, width, HEIGHT)
                axes = axes_at(drawn, box)
                for label, each in by_label.items():
                    values = [100 * each[scheme].fields[name].mean for scheme in schemes]
                    _line(axes, range(len(schemes)), values, labels.index(label), label)
                axes.axhline(100, color="#999999", linewidth=0.6, zorder=1)
                axes.set_xticks(range(len(schemes)), schemes, rotation=45, ha="right")
                _finish(axes, legend=row == column == 0)
                axes.set_xlabel(title + _layout_note(scores, layout))
                if column == 0:
                    axes.set_ylabel("%")
    return drawn


def draw_weight_sweeps(sweeps: Mapping[str, Mapping[str, Sequence[float]]]) -> Figure:
    """Draw the errors of `fem-asm` at the markers and over the body against the weight of the markers.

    Args:
        sweeps: For each layout the columns of `compare.crossval.solver_folds.sweep_weights`; a row each.
    """
    panels: dict[str, dict[str, str]] = {
        "root mean square, mm": {"in_sample_mm": "markers given", "left_out_mm": "each held out"},
        "distance from the truth, %": FIELD_NAMES,
    }
    between, top = LEFT, HEAD + len(FIELD_NAMES) * LEGEND_LINE
    width = (WIDTH - LEFT - 0.1 - between) / 2
    with figure(top + len(sweeps) * ROW) as drawn:
        write_heading(
            drawn,
            "fem-asm for other weights of the markers",
            "All markers given, first seed. Factors of the weight that it has.",
        )
        for row, (layout, sweep) in enumerate(sweeps.items()):
            for column, (label, lines) in enumerate(panels.items()):
                axes = axes_at(drawn, (LEFT + column * (width + between), top + row * ROW, width, HEIGHT))
                for number, (name, title) in enumerate(lines.items()):
                    values = [100 * value if column else value for value in sweep[name]]
                    axes.plot(
                        sweep["factor"], values, color=solver_colour(number), linewidth=1.2, label=title
                    )
                axes.set_xscale("log")
                axes.set_xlabel("factor of the weight" + _layout_note(sweeps, layout))
                axes.set_ylabel(label)
                _finish(axes, legend=False)
                if column == 0:
                    axes.set_ylim(bottom=SMALLEST)
                    axes.yaxis.set_major_formatter("{x:g}")
                if row == 0:
                    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0, labelspacing=0.2)
    return drawn


def _labels(by_layout: Mapping[str, Mapping[str, object]]) -> list[str]:
    """The solvers of all layouts."""
    return list(dict.fromkeys(label for each in by_layout.values() for label in each))


def _layout_note(by_layout: Mapping[str, object], layout: str) -> str:
    """The layout's name, for the end of a label, if there are several."""
    return f"; {layout}" if len(by_layout) > 1 else ""


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
    axes.grid()
    axes.set_axisbelow(True)
    if legend:
        legend_above(axes)

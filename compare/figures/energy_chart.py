"""Energy on the way to the solution, from the record that a solver keeps."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from compare.evaluation.comparison import Comparison
from compare.evaluation.evaluation import Evaluation
from compare.figures.style import axes_at, heading, legend_above, legend_height, solver_colour
from geometry.arrays import FloatArray
from geometry.figure import INK, WIDTH, Figure, figure

LOG_RATIO = 20.0
"""An axis is logarithmic where the largest value exceeds the smallest by this factor."""
HEAD, HEIGHT, FOOT, LEFT, GAP = 0.3, 1.6, 0.45, 0.75, 0.85
"""Heights, the left margin and the gap between charts, inches."""
FEW = 3
"""Records of no more rows are single results, not a curve: a dotted line joins them."""
ENERGY = "energy"

Group = tuple[str, str]


def recorded(evaluations: Sequence[Evaluation]) -> dict[Group, list[Evaluation]]:
    """The evaluations that have a record, by its abscissa (the first column) and the column to draw over it.

    That is `energy` where there is one, else the second column.
    """
    groups: dict[Group, list[Evaluation]] = {}
    for evaluation in evaluations:
        abscissa, *others = list(evaluation.history) or [""]
        if others and len(evaluation.history[abscissa]):
            column = ENERGY if ENERGY in others else others[0]
            groups.setdefault((abscissa, column), []).append(evaluation)
    return groups


def approaches_reference(group: Group) -> bool:
    """True if the record should end at the reference's energy.

    The record of a load that grows is a path through other problems, and other columns are no energies.
    """
    abscissa, column = group
    return column == ENERGY and not abscissa.startswith("load")


def draw_energy(comparison: Comparison) -> Figure | None:
    """Draw every solver's record, a row for each kind; beside it the distance from the reference's energy.

    None without a record.
    """
    evaluations, reference = comparison.evaluations, comparison.reference
    groups = recorded(evaluations)
    colours = {evaluation.solver: solver_colour(number) for number, evaluation in enumerate(evaluations)}
    if not groups:
        return None
    line = f"{reference.label} {reference.energy:.4g}"
    heights = [
        legend_height([*map(record_label, members), *([line] if approaches_reference(group) else [])])
        for group, members in groups.items()
    ]
    with figure(HEAD + sum(heights) + len(groups) * (HEIGHT + FOOT)) as drawn:
        heading(drawn, "Energy on the way to the solution")
        for row, (group, members) in enumerate(groups.items()):
            others = [each for each in members if each is not reference and not each.in_sample]
            compared = others if approaches_reference(group) else []
            columns = 2 if compared else 1
            width = (WIDTH - LEFT - 0.15 - (columns - 1) * GAP) / columns
            top = HEAD + sum(heights[: row + 1]) + row * (HEIGHT + FOOT)
            axes = axes_at(drawn, (LEFT, top, width, HEIGHT))
            _records(axes, group, members, colours)
            if compared:
                dashes = (0, (4, 2))
                axes.axhline(reference.energy, color=INK, lw=0.9, ls=dashes, label=line, zorder=1)
                beside = axes_at(drawn, (LEFT + width + GAP, top, width, HEIGHT))
                _distances(beside, group, compared, colours, reference)
            legend_above(axes)
    return drawn


def record_label(evaluation: Evaluation) -> str:
    """The solver and the energy of its result."""
    return f"{evaluation.label} {evaluation.energy:.4g}"


def _records(axes: Axes, group: Group, members: Sequence[Evaluation], colours: dict[str, str]) -> None:
    abscissa, column = group
    for evaluation in members:
        y = evaluation.history[column]
        _line(axes, evaluation.history[abscissa], y, colours[evaluation.solver], record_label(evaluation))
    _scale(axes, group, [evaluation.history[column] for evaluation in members], members)
    axes.set_ylabel(readable(column))


def _distances(
    axes: Axes, group: Group, members: Sequence[Evaluation], colours: dict[str, str], reference: Evaluation
) -> None:
    distances = [np.abs(evaluation.history[ENERGY] / reference.energy - 1) for evaluation in members]
    for evaluation, distance in zip(members, distances, strict=True):
        _line(axes, evaluation.history[group[0]], 100 * distance, colours[evaluation.solver], None)
    _scale(axes, group, distances, members)
    axes.set_ylabel(f"distance from {reference.solver}, %")


def _line(axes: Axes, x: FloatArray, y: FloatArray, colour: str, label: str | None) -> None:
    marker, style = "o" if len(x) <= 40 else "", "-" if len(x) > FEW else ":"
    axes.plot(x, y, style, color=colour, linewidth=1.2, marker=marker, markersize=3, label=label, zorder=2)


def _scale(axes: Axes, group: Group, ordinates: Sequence[FloatArray], members: Sequence[Evaluation]) -> None:
    axes.set_xlabel(readable(group[0]))
    if wants_log(np.concatenate([evaluation.history[group[0]] for evaluation in members])):
        axes.set_xscale("log")
    if wants_log(np.concatenate(ordinates)):
        axes.set_yscale("log")
    axes.grid(color="#dddddd", linewidth=0.5)


def wants_log(values: FloatArray) -> bool:
    """True if a logarithmic axis helps: all values are positive and they span more than `LOG_RATIO`."""
    finite = values[np.isfinite(values)]
    return bool(finite.size and finite.min() > 0 and finite.max() > LOG_RATIO * finite.min())


def readable(name: str) -> str:
    """A column's name for an axis: with its unit where it has one, without underscores."""
    names = {
        "seconds": "time, s",
        ENERGY: "energy, N mm/mm",
        "curve_energy": "energy added, N mm/mm",
        "units": "hidden units of the network",
        "load_fraction": "share of the load",
        "weight_factor": "factor of the markers’ weight",
    }
    return names.get(name, name.replace("_", " "))

"""Charts of records: energy, convergence and losses on the way to a solution."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from compare.evaluation.comparison import Results
from compare.evaluation.evaluation import Evaluation
from compare.figures.style import (
    axes_at,
    legend_above,
    legend_height,
    solver_colour,
    write_heading,
    write_letter,
)
from geometry.arrays import FloatArray
from geometry.figure import INK, WIDTH, Figure, figure

HEAD = 0.3
"""Height of the heading, inches."""

Group = tuple[str, str]
"""Abscissa and ordinate of a record: names of its columns."""


def records_by_kind(evaluations: Sequence[Evaluation]) -> dict[Group, list[Evaluation]]:
    """The evaluations by the first column of their record and the one over it: `energy`, or the second."""
    groups: dict[Group, list[Evaluation]] = {}
    for evaluation in evaluations:
        abscissa, *others = list(evaluation.history) or [""]
        if others and len(evaluation.history[abscissa]):
            column = "energy" if "energy" in others else others[0]
            groups.setdefault((abscissa, column), []).append(evaluation)
    return groups


def approaches_reference(group: Group) -> bool:
    """True if the record should end at the reference's energy.

    The record of a load that grows is a path through other problems, and other columns are no energies.
    """
    abscissa, column = group
    return column == "energy" and not abscissa.startswith("load")


def draw_energy(comparison: Results) -> Figure | None:
    """Draw every record of another kind than energies of one problem, a lettered panel for each kind.

    Along a load that grows, or over factors of the markers' weight. None without a record.
    """
    groups = records_by_kind(comparison.evaluations)
    chosen = {group: members for group, members in groups.items() if not approaches_reference(group)}
    return _draw_kinds(comparison, chosen, "Energy along the load and over the markers’ weight")


def draw_convergence(comparison: Results) -> Figure | None:
    """Draw energies on the way to the solution; beside them their distances from the reference's energy.

    None without such a record.
    """
    groups = records_by_kind(comparison.evaluations)
    chosen = {group: members for group, members in groups.items() if approaches_reference(group)}
    return _draw_kinds(comparison, chosen, "Energy on the way to the solution")


def _draw_kinds(
    comparison: Results, groups: Mapping[Group, Sequence[Evaluation]], heading: str
) -> Figure | None:
    """Lettered panels in rows, one for each kind of record; None if there is none."""
    evaluations, reference = comparison.evaluations, comparison.reference
    if not groups:
        return None
    colours = {evaluation.solver: solver_colour(number) for number, evaluation in enumerate(evaluations)}
    line = f"{reference.label} {reference.energy:.4g}"
    height, foot, left, gap = 1.6, 0.45, 0.75, 0.85  # inches
    heights = [
        legend_height([*map(_record_label, members), *([line] if approaches_reference(group) else [])])
        for group, members in groups.items()
    ]
    with figure(HEAD + sum(heights) + len(groups) * (height + foot)) as drawn:
        write_heading(drawn, heading)
        for row, (group, members) in enumerate(groups.items()):
            others = [each for each in members if each is not reference and not each.in_sample]
            compared = others if approaches_reference(group) else []
            columns = 2 if compared else 1
            width = (WIDTH - left - 0.15 - (columns - 1) * gap) / columns
            top = HEAD + sum(heights[: row + 1]) + row * (height + foot)
            axes = axes_at(drawn, (left, top, width, height))
            energies = [each.history[group[1]] for each in members]
            _draw_records(axes, group, members, energies, colours, [_record_label(each) for each in members])
            axes.set_ylabel(readable(group[1]))
            if compared:
                dashes = (0, (4, 2))
                axes.axhline(reference.energy, color=INK, lw=0.9, ls=dashes, label=line, zorder=1)
                beside = axes_at(drawn, (left + width + gap, top, width, height))
                away = [100 * np.abs(each.history["energy"] / reference.energy - 1) for each in compared]
                _draw_records(beside, group, compared, away, colours, [None] * len(compared))
                beside.set_ylabel(f"distance from {reference.solver}, %")
            legend_above(axes)
        for number, axes in enumerate(drawn.axes if len(drawn.axes) > 1 else []):
            write_letter(axes, number)
    return drawn


def _record_label(evaluation: Evaluation) -> str:
    return f"{evaluation.label} {evaluation.energy:.4g}"


def _draw_records(
    axes: Axes,
    group: Group,
    members: Sequence[Evaluation],
    ordinates: Sequence[FloatArray],
    colours: dict[str, str],
    labels: Sequence[str | None],
) -> None:
    for evaluation, y, label in zip(members, ordinates, labels, strict=True):
        x = evaluation.history[group[0]]
        # Three results or fewer are no curve: a dotted line joins them.
        marker, style = "o" if len(x) <= 40 else "", "-" if len(x) > 3 else ":"
        colour = colours[evaluation.solver]
        axes.plot(x, y, style, color=colour, marker=marker, label=label, lw=1.2, ms=3, zorder=2)
    axes.set_xlabel(readable(group[0]))
    if wants_log(np.concatenate([evaluation.history[group[0]] for evaluation in members])):
        axes.set_xscale("log")
    if wants_log(np.concatenate(ordinates)):
        axes.set_yscale("log")
    axes.grid()


def wants_log(values: FloatArray) -> bool:
    """True if a logarithmic axis helps: all values are positive, the largest above 20 times the smallest."""
    finite = values[np.isfinite(values)]
    return bool(finite.size and finite.min() > 0 and finite.max() > 20 * finite.min())


def readable(name: str) -> str:
    """A column's name for an axis: with its unit where it has one, without underscores."""
    names = {
        "seconds": "time, s",
        "energy": "energy, N mm/mm",
        "curve_energy": "energy added, N mm/mm",
        "units": "hidden units of the network",
        "load_fraction": "share of the load",
        "weight_factor": "factor of the markers’ weight",
    }
    return names.get(name, name.replace("_", " "))


def draw_losses(comparison: Results) -> Figure | None:
    """Draw a chart for each term of the loss, with a line for every solver that has it (Fig. 7 of the paper).

    None without a record.
    """
    trained = {
        number: evaluation
        for number, evaluation in enumerate(comparison.evaluations)
        if {"epoch", "PDE"} <= evaluation.history.keys()
    }
    if not trained:
        return None
    units = {"PDE": "MPa", "BC": "mm²", "ASM": "mm²"}
    terms = [name for name in units if any(name in each.history for each in trained.values())]
    head = HEAD + legend_height([evaluation.label_at_markers for evaluation in trained.values()])
    height, gap, foot, left = 1.15, 0.15, 0.42, 0.85  # inches
    with figure(head + len(terms) * (height + gap) + foot) as drawn:
        write_heading(drawn, "Losses over the epochs, without their weights")
        for row, term in enumerate(terms):
            axes = axes_at(drawn, (left, head + row * (height + gap), WIDTH - left - 0.15, height))
            for number, evaluation in trained.items():
                if term in evaluation.history:
                    epochs, losses = evaluation.history["epoch"], evaluation.history[term]
                    colour, label = solver_colour(number), evaluation.label_at_markers
                    axes.plot(epochs, losses, color=colour, lw=1, label=label)
                    if wants_log(losses):
                        axes.set_yscale("log")
            axes.set_ylabel(rf"$\mathcal{{L}}_\mathrm{{{term}}}$, {units[term]}")
            axes.grid()
            if row == 0:
                legend_above(axes)
            if row < len(terms) - 1:
                axes.tick_params(labelbottom=False)
        axes.set_xlabel("epoch")
    return drawn

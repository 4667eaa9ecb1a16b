"""Charts of solvers: the record of each on the way to its solution, and its errors at the markers."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, NullLocator

from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.evaluation.scores import SolverScores
from pinnray.comparison.figures.style import (
    axes_at,
    legend_above,
    legend_below_heading,
    legend_height,
    solver_colour,
    write_heading,
    write_letter,
)
from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.runtime.figure import INK, MUTED, SMALL, WIDTH, Figure, figure

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


def draw_convergence(comparison: Results) -> Figure | None:
    """Draw the records of energy, a row of lettered panels for each kind; None without a record.

    Energies on the way to a solution have their distances from the reference's energy beside them. Others are
    along a load that grows, or over factors of the markers' weight.
    """
    groups = records_by_kind(comparison.evaluations)
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
        write_heading(drawn, "Records of the energy")
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


CIRCLE: dict[str, Any] = {"ls": "", "marker": "o", "ms": 3.2, "mfc": "white", "mew": 0.8}
"""Look of a training error, which is seen even where the error vanishes."""


def draw_marker_errors(comparison: Results) -> Figure:
    """Bars of |du| and |dv| at every marker (Fig. 6 of the paper), all on one logarithmic scale.

    Bars: at markers that the solver was not given. Circles: at markers that it was given.
    """
    evaluations, observations = comparison.evaluations, comparison.observations
    head, title, height, gap, foot = 0.62, 0.19, 0.5, 0.1, 0.4  # inches: with legend; a solver's name; ...
    left, step = 0.72, title + height + gap
    width = WIDTH / 2 - left - 1.02  # where the means stand
    scores = [comparison.scores[evaluation.solver] for evaluation in evaluations]
    span = _span(scores)
    with figure(head + len(evaluations) * step + foot) as drawn:
        write_heading(drawn, f"Absolute error at the markers, against {observations.label} displacements")
        fitted = any(evaluation.in_sample for evaluation in evaluations)
        handles = [
            Patch(facecolor=MUTED, edgecolor=MUTED, label="held out: the solver was not given this marker"),
            Line2D([], [], **CIRCLE, color=MUTED, label="training: it was given this marker (†)"),
        ]
        legend_below_heading(drawn, handles[: 1 + fitted], length=1.4)
        for row, (evaluation, own) in enumerate(zip(evaluations, scores, strict=True)):
            for column, symbol in enumerate("uv"):
                axes = axes_at(drawn, (left + column * WIDTH / 2, head + title + row * step, width, height))
                _draw_errors(axes, symbol, own, solver_colour(row), span[0])
                _set_scales(axes, observations.visible, span)
                axes.set_ylabel(rf"$|\Delta {symbol}|$, mm", size=SMALL)
                if row == 0:
                    axes.text(1.03, 1.06, "mean, mm", size=SMALL, color=INK, transform=axes.transAxes)
                if column == 0:
                    axes.set_title(evaluation.label_at_markers, size=8.5, pad=2, weight="bold")
                if row == len(evaluations) - 1:
                    axes.set_xlabel("marker, by its number in the drawing")
                else:
                    axes.tick_params(labelbottom=False)
    return drawn


DECADES = 4
"""Powers of ten below the largest error at which the scale of errors ends at the latest."""

SMALLEST = 1e-6
"""Errors below this, mm, are those of rounding."""


def _span(scores: Sequence[SolverScores]) -> tuple[float, float]:
    """Powers of ten around the errors of the solvers that converged (or of any), mm."""
    chosen = [own for own in scores if own.converged] or scores
    errors = [each for own in chosen for each in (own.markers, own.held_out) if each is not None]
    found = np.concatenate([np.append(each.ae_u, each.ae_v) for each in errors])
    found = found[np.isfinite(found) & (found > SMALLEST)]
    if not len(found):
        return SMALLEST, 1e3 * SMALLEST
    high = float(np.ceil(np.log10(found.max()) - 1e-9))
    low = max(float(np.floor(np.log10(found.min()))), high - DECADES)
    return 10 ** min(low, high - 1), 10**high


def _draw_errors(axes: Axes, symbol: str, own: SolverScores, colour: str, floor: float) -> None:
    """The bars and circles of one solver and component, and their means beside; none is below the floor."""
    words = []
    for errors, kind in ((own.held_out, "held out"), (own.given, "training")):
        if errors is None:
            continue
        values = np.maximum(getattr(errors, f"ae_{symbol}"), floor)  # a scale of powers has no zero
        marker = np.arange(1, len(values) + 1)
        seen = np.isfinite(values)
        if errors is own.given:
            axes.plot(marker[seen], values[seen], **CIRCLE, color=INK, clip_on=False, zorder=3)
        else:
            axes.bar(marker[seen], values[seen], 0.72, color=colour, edgecolor=colour, linewidth=0.6)
        words.append(f"{getattr(errors, f'mae_{symbol}'):.3f} {kind}")
    axes.text(1.03, 0.5, "\n".join(words), size=SMALL, va="center", color=MUTED, transform=axes.transAxes)


def _set_scales(axes: Axes, visible: BoolArray, span: tuple[float, float]) -> None:
    count = len(visible)
    for marker in np.flatnonzero(~visible) + 1:
        place = axes.get_xaxis_transform()
        axes.text(marker, 0.04, "×", size=SMALL, color=MUTED, ha="center", transform=place)
    axes.set_xticks(range(1, count + 1) if count <= 12 else range(1, count + 1, 5))
    axes.set_xlim(0.4, count + 0.6)
    axes.set_ylim(*span)  # first: a scale of powers cannot find limits for bars that are all at one height
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(numticks=4))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter("{x:g}")
    axes.tick_params(labelsize=SMALL)
    axes.grid(axis="y")
    axes.set_axisbelow(True)

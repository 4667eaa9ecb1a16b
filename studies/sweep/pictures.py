"""Pictures of a sweep: quantities over its parameters."""

from collections.abc import Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import LogNorm, Normalize
from matplotlib.patches import Rectangle

from pinnray.comparison.figures.layout import HALO, axes_at, write_heading
from pinnray.comparison.figures.solver_colours import solver_look
from pinnray.runtime.figure import INK, NARROW, SMALL, WIDTH, Figure, figure
from pinnray.solvers.finger_figures import QUANTITIES
from pinnray.studies.sweep.study import Value, unit_of
from pinnray.studies.sweep.sweep import Sweep

SHOWN = ("force", "wrap", "tip_v", "compliance_across", "von_mises", "mass")
"""Quantities of the pictures; the tables have all."""

MOST_DOTS = 2_000
"""Largest number of samples drawn in a panel."""

NARROWEST = 0.75
"""Least width of a column whose words have room beside those of the next, inches; else they stand upright."""


def draw_pairs(sweep: Sweep, page: float = WIDTH) -> Figure:
    """Draw quantities over the varied parameters, a dot for each sample, on a page of a width in inches."""
    names = [name for name in SHOWN if _varies(sweep, name)]
    parameters = list(sweep.study.varied)
    good = sweep.good[:MOST_DOTS]
    size = float(np.clip(30 / np.sqrt(len(good)), 1.0, 3.5))
    upright = (page - 1.2) / len(parameters) < NARROWEST
    foot = 1.75 if upright else 0.95
    height = 0.5 + foot + 0.74 * len(names)
    room = {"left": 1.1 / page, "right": 1 - 0.1 / page, "top": 1 - 0.5 / height, "bottom": foot / height}
    with figure(height, page) as drawn:
        note = f"{len(good)} of {len(sweep.good)} samples"
        colour = solver_look(sweep.study.solver).colour
        write_heading(drawn, f"Quantities over parameters: {sweep.study.name}", note)
        grid = drawn.subplots(
            len(names), len(parameters), sharex="col", sharey="row", squeeze=False, gridspec_kw=room
        )
        for row, name in zip(grid, names, strict=True):
            row[0].set_ylabel(_label(name), rotation=0, ha="right", va="center")
            for axes, parameter in zip(row, parameters, strict=True):
                texts = [sweep.samples[each.number][parameter] for each in good]
                choices = sweep.study.varied[parameter].values
                x = [choices.index(text) if choices else text for text in texts]
                values = [each.values[name] for each in good]
                axes.plot(x, values, "o", ms=size, color=colour, alpha=0.7, mew=0, clip_on=False, zorder=3)
                axes.tick_params(length=2, pad=1.5)
                axes.locator_params(axis="y", nbins=3)
                axes.margins(y=0.1)
        for axes, parameter in zip(grid[-1], parameters, strict=True):
            ends = _ends(sweep, parameter)
            choices = sweep.study.varied[parameter].values
            low, high = (0.0, len(choices) - 1.0) if choices else map(float, ends)
            room_beside = 0.06 * (high - low or 1.0)
            axes.set_xlim(low - room_beside, high + room_beside)  # both ends have their numbers
            labels = axes.set_xticks([low, high], ends, rotation=90 if upright else 0)
            labels[0].label1.set_horizontalalignment("left")
            labels[-1].label1.set_horizontalalignment("right")
            words = _words(parameter) if upright else _words(parameter, "\n", "\n")
            axes.set_xlabel(words, rotation=90 if upright else 0, labelpad=2)
    return drawn


def draw_maps(sweep: Sweep, names: Sequence[str], page: float = WIDTH) -> Figure:
    """Draw quantities as colours over the two parameters of a grid; the least value of each has a frame."""
    first, second = sweep.study.varied
    x, y = (list(dict.fromkeys(sample[name] for sample in sweep.samples)) for name in (first, second))
    head, cell, left, gap = 0.68, 0.34, 0.95, 0.25
    columns = 1 if page < NARROW else len(names)
    width, row_height = (page - left - 0.1) / columns - gap, cell * len(y) + 0.75
    with figure(head - 0.25 + row_height * -(-len(names) // columns), page) as drawn:
        write_heading(drawn, f"Quantities over the grid: {sweep.study.name}", "framed: the least value")
        for number, name in enumerate(names):
            line, column = divmod(number, columns)
            place = left + column * (width + gap), head + line * row_height
            axes = axes_at(drawn, (*place, width, cell * len(y)))
            table = np.full((len(y), len(x)), np.nan)
            for each in sweep.measurements:
                at, value = sweep.samples[each.number], each.values.get(name, np.nan)
                here = x.index(at[first]), y.index(at[second])
                table[here[::-1]] = value
                words = f"{value:.3g}" if np.isfinite(value) else each.state
                axes.text(*here, words, ha="center", va="center", size=SMALL, path_effects=HALO)
            if np.isfinite(table).any():
                scale = LogNorm() if np.nanmin(table) > 0 else Normalize()
                axes.imshow(table, norm=scale, cmap=colormaps["viridis_r"], aspect="auto")
                row, best = np.unravel_index(np.nanargmin(table), table.shape)
                corner = (float(best) - 0.5, float(row) - 0.5)
                axes.add_patch(Rectangle(corner, 1, 1, fill=False, edgecolor=INK, lw=1.8, clip_on=False))
            axes.set(xlim=(-0.5, len(x) - 0.5), ylim=(-0.5, len(y) - 0.5))
            axes.set_xticks(range(len(x)), [_short(value) for value in x])
            axes.set_yticks(range(len(y)), [] if column else [_short(value) for value in y])
            axes.tick_params(length=0)
            axes.set_title(name.replace("_", " "), fontsize=8.5)
            axes.set_xlabel(_words(first))
            if not column:
                axes.set_ylabel(_words(second, "\n"))
    return drawn


def _varies(sweep: Sweep, name: str) -> bool:
    values = np.array([each.values[name] for each in sweep.good])
    if len(values) < 2 or not np.isfinite(values).all():
        return False
    return bool(np.ptp(values) > 1e-9 * np.abs(values).max())


def _label(name: str) -> str:
    unit = QUANTITIES[name].unit.replace("deg", "°")
    return name.replace("_", "\n") + (f"\n{unit}" if unit else "")


def _words(parameter: str, between: str = " ", after: str = ", ") -> str:
    """The words of a parameter and its unit, with texts between the words and after them."""
    unit = unit_of(parameter).replace("deg", "°")
    return parameter.replace("_", between) + (f"{after}{unit}" if unit else "")


def _ends(sweep: Sweep, parameter: str) -> tuple[str, str]:
    """Both ends of a parameter's range, or its first and last choice."""
    values = sweep.study.varied[parameter]
    if values.values is not None:
        return str(values.values[0])[:9], str(values.values[-1])[:9]
    return f"{values.low:g}", f"{values.high:g}"


def _short(value: Value) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)

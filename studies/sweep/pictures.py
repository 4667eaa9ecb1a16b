"""Pictures of a sweep: quantities over its parameters."""

import numpy as np

from pinnray.comparison.figures.layout import write_heading
from pinnray.comparison.figures.solver_colours import solver_look
from pinnray.runtime.figure import WIDTH, Figure, figure
from pinnray.solvers.finger_figures import QUANTITIES
from pinnray.studies.sweep.study import unit_of
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

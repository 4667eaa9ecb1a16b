"""Pictures of a sweep: quantities over parameters, sensitivities, and fingers."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import LogNorm, Normalize
from matplotlib.patches import Rectangle

from pinnray.comparison.figures.style import HALO, axes_at, write_heading
from pinnray.geometry.drawing.drawn_finger import finger_from
from pinnray.geometry.finger.picture import draw_section
from pinnray.runtime.figure import CONTACT, INK, MUTED, SMALL, WIDTH, Figure, figure
from pinnray.solvers.finger_figures import QUANTITIES
from pinnray.studies.sweep.job import StudyJob
from pinnray.studies.sweep.sensitivity import TRUSTED, Sensitivity
from pinnray.studies.sweep.study import Study, Value, title, unit_of
from pinnray.studies.sweep.sweep import Sweep

SHOWN = ("force", "wrap", "tip_v", "compliance_across", "von_mises", "mass")
"""Quantities of the pictures; the tables have all."""

MOST_DOTS = 2_000
"""Largest number of samples drawn in a panel."""

WIDE = 6
"""Largest number of columns that have room for long words."""

COLUMNS = 3
"""Fingers in a row of the drawing: with the least, the median and the largest value."""


def draw_pairs(sweep: Sweep) -> Figure:
    """Draw quantities over the varied parameters: a dot for each sample."""
    names = [name for name in SHOWN if _varies(sweep, name)]
    parameters = list(sweep.study.varied)
    good = sweep.good[:MOST_DOTS]
    size = float(np.clip(30 / np.sqrt(len(good)), 1.0, 3.5))
    left, head, foot, gap, tall = 1.1, 0.5, 0.95, 0.12, 0.62
    width = (WIDTH - left - 0.1 - gap * (len(parameters) - 1)) / len(parameters)
    with figure(head + foot + (tall + gap) * len(names)) as drawn:
        note = f"{len(good)} of {len(sweep.good)} samples"
        write_heading(drawn, f"Quantities over parameters: {sweep.study.name}", note)
        for row, name in enumerate(names):
            values = np.array([each.values[name] for each in good])
            for column, parameter in enumerate(parameters):
                place = (left + column * (width + gap), head + row * (tall + gap), width, tall)
                axes = axes_at(drawn, place)
                texts = [sweep.samples[each.number][parameter] for each in good]
                choices = sweep.study.varied[parameter].values
                x = np.array([choices.index(text) if choices else text for text in texts], dtype=np.float64)
                axes.plot(x, values, "o", ms=size, color="#0072b2", alpha=0.7, mew=0, clip_on=False, zorder=3)
                axes.tick_params(length=2, pad=1.5)
                axes.locator_params(axis="y", nbins=3)
                ends = _ends(sweep, parameter)
                ticks = [0.0, len(choices) - 1.0] if choices else [float(end) for end in ends]
                room = 0.06 * (ticks[1] - ticks[0] or 1.0)
                axes.set_xlim(ticks[0] - room, ticks[1] + room)  # both ends have their numbers
                axes.set_xticks(ticks)
                axes.margins(y=0.1)
                if column:
                    axes.set_yticklabels([])
                else:
                    axes.set_ylabel(_label(name), rotation=0, ha="right", va="center")
                if row < len(names) - 1:
                    axes.set_xticklabels([])
                else:
                    labels = axes.set_xticklabels(ends)
                    labels[0].set_horizontalalignment("left")
                    labels[-1].set_horizontalalignment("right")
                    axes.set_xlabel(_wrapped(parameter, narrow=len(parameters) > WIDE), labelpad=2)
    return drawn


def draw_maps(sweep: Sweep, names: Sequence[str]) -> Figure:
    """Draw quantities as colours over the two parameters of a grid; the least value of each has a frame."""
    first, second = sweep.study.varied
    x, y = (list(dict.fromkeys(sample[name] for sample in sweep.samples)) for name in (first, second))
    head, cell, left, gap = 0.68, 0.34, 0.95, 0.25
    width = (WIDTH - left - 0.1) / len(names) - gap
    with figure(head + cell * len(y) + 0.5) as drawn:
        write_heading(drawn, f"Quantities over the grid: {sweep.study.name}", "framed: the least value")
        for column, name in enumerate(names):
            axes = axes_at(drawn, (left + column * (width + gap), head, width, cell * len(y)))
            table = np.full((len(y), len(x)), np.nan)
            for each in sweep.measurements:
                at, value = sweep.samples[each.number], each.values.get(name, np.nan)
                place = x.index(at[first]), y.index(at[second])
                table[place[::-1]] = value
                words = f"{value:.3g}" if np.isfinite(value) else each.state
                axes.text(*place, words, ha="center", va="center", size=SMALL, path_effects=HALO)
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
            axes.set_xlabel(title(first))
        drawn.axes[0].set_ylabel(title(second).replace("_", "\n"))
    return drawn


def draw_sensitivity(found: Mapping[str, Sensitivity]) -> Figure:
    """Draw the total indices as a table of colours, with the first-order ones in brackets."""
    names, parameters = list(found), list(next(iter(found.values())).total)
    left, head, foot, tall = 1.25, 1.2, 0.3, 0.34
    width = WIDTH - left - 0.1
    with figure(head + foot + tall * len(names)) as drawn:
        write_heading(
            drawn,
            "Share of each quantity's variance by parameter, %",
            "alone and with others; in brackets: alone",
        )
        axes = axes_at(drawn, (left, head, width, tall * len(names)))
        table = np.array([[100 * found[name].total[p] for p in parameters] for name in names])
        axes.imshow(table, cmap=colormaps["Blues"], norm=Normalize(0, 130), aspect="auto")
        for row, name in enumerate(names):
            for column, parameter in enumerate(parameters):
                total, first = (100 * share[parameter] for share in (found[name].total, found[name].first))
                text = f"{total:.0f}" + (f" ({first:.0f})" if len(parameters) <= WIDE else f"\n({first:.0f})")
                axes.text(column, row, text, ha="center", va="center", size=SMALL, linespacing=0.95)
        axes.set_xticks(
            range(len(parameters)), [_wrapped(name, narrow=len(parameters) > WIDE) for name in parameters]
        )
        axes.set_yticks(range(len(names)), [name + _doubt(found[name]) for name in names])
        axes.xaxis.tick_top()
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
        if any(map(_doubt, found.values())):
            drawn.text(0.012, 0.1 / drawn.get_figheight(), "*: not to be trusted", size=SMALL, color=MUTED)
    return drawn


def draw_fingers(sweep: Sweep, job: StudyJob[Study]) -> Figure:
    """Draw, to one scale, the fingers with the least, the median and the largest value of each quantity."""
    names = [name for name in SHOWN[:4] if _varies(sweep, name)]
    chosen = []
    for name in names:
        ranked = sorted(sweep.good, key=lambda each: each.values[name])
        for each in [ranked[0], ranked[len(ranked) // 2], ranked[-1]] if len(ranked) > 2 else ranked:
            finger = finger_from(job.task(each.number, sweep.samples[each.number]).definition)
            chosen.append((finger, each.number, name, each.values[name]))
    low = np.min([finger.section.bounds[0] for finger, *_ in chosen], axis=0)
    high = np.max([finger.section.bounds[1] for finger, *_ in chosen], axis=0)
    width = (WIDTH - 0.2) / COLUMNS
    height = (width - 0.1) * (high[1] - low[1]) / (high[0] - low[0])
    head, label, foot = 0.38, 0.4, 0.1
    columns = min(COLUMNS, len(sweep.good))
    which = (
        "the least, the median and the largest value" if columns > 2 else "the least and the largest value"
    )
    with figure(head + (height + label) * len(names) + foot) as drawn:
        write_heading(drawn, f"Fingers with {which}", "all to one scale")
        for place, (finger, number, name, value) in enumerate(chosen):
            row, column = divmod(place, columns)
            box = (0.1 + column * width, head + row * (height + label) + label, width - 0.1, height)
            axes = axes_at(drawn, box)
            draw_section(axes, finger.section)
            front = np.array([finger.section.front_point(x) for x in np.linspace(*finger.contact_ends, 5)])
            axes.plot(*front.T, color=CONTACT, lw=2.5, solid_capstyle="butt", zorder=3)
            axes.set(xlim=(low[0] - 1, high[0] + 1), ylim=(low[1] - 1, high[1] + 1), aspect="equal")
            axes.set_axis_off()
            if not column:
                unit = QUANTITIES[name].unit.replace("deg", "°")
                axes.set_title(f"{name}, {unit}", size=SMALL, pad=14, loc="left", weight="bold")
            axes.text(0, 1.04, f"{value:.3g} (sample {number})", size=SMALL, transform=axes.transAxes)
    return drawn


def _varies(sweep: Sweep, name: str) -> bool:
    values = np.array([each.values[name] for each in sweep.good])
    if len(values) < 2 or not np.isfinite(values).all():
        return False
    return bool(np.ptp(values) > 1e-9 * np.abs(values).max())


def _label(name: str) -> str:
    unit = QUANTITIES[name].unit.replace("deg", "°")
    return name.replace("_", "\n") + (f"\n{unit}" if unit else "")


def _wrapped(parameter: str, *, narrow: bool) -> str:
    """A parameter with a line for each of its words, and its unit; long words are cut for a narrow column."""
    unit = unit_of(parameter).replace("deg", "°")
    words = parameter.replace("_", "\n")
    return (words.replace("thickness", "thick-\nness") if narrow else words) + (f"\n{unit}" if unit else "")


def _ends(sweep: Sweep, parameter: str) -> tuple[str, str]:
    """Both ends of a parameter's range, or its first and last choice."""
    values = sweep.study.varied[parameter]
    if values.values is not None:
        return str(values.values[0])[:9], str(values.values[-1])[:9]
    return f"{values.low:g}", f"{values.high:g}"


def _short(value: Value) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _doubt(found: Sensitivity) -> str:
    return "" if found.explained >= TRUSTED else " *"

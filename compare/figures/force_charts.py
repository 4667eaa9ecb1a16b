"""Charts of the indenter's force: over its stroke by every solver, over time by the markers."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.evaluation.force_curves import ForceCurve, follows_load
from pinnray.comparison.figures.layout import axes_at, legend_above, legend_height, write_heading
from pinnray.comparison.figures.solver_colours import solver_look
from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.runtime.figure import COLUMN, CONTACT, INK, MEASURED, WIDTH, Figure, figure
from pinnray.runtime.tables import number

WAY_BACK = "#0072b2"
"""Colour of the frames that are held or on the way back."""


def draw_force_displacement(
    curves: Sequence[ForceCurve],
    *,
    depth: float,
    truth: ForceCurve | None = None,
    identified: Sequence[Evaluation] = (),
    page: float = WIDTH,
) -> Figure:
    """Draw every curve: per mm of depth on the left axis, for the depth, mm, on the right one.

    A solver has its mark at each of its equilibria, a linear one a dashed line. The
    simulated finger's curve ends in a cross. A force that was identified from the markers is a square with
    its interval of 95 % at the end of the stroke.
    """
    labels = [_end_label(curve.evaluation.label, curve.force[-1] * depth) for curve in curves]
    true_label = [_end_label("truth, simulated", truth.force[-1] * depth)] if truth else []
    found = [(each, each.identified.force) for each in identified if each.identified is not None]
    more = [f"{_end_label(each.label, force.value * depth)}, identified" for each, force in found]
    top, height, left = 0.3 + legend_height([*labels, *true_label, *more], page), 2.4, 0.75  # inches
    apart = 0.08 / (page - left - 0.65)  # the room of a mark, as a share of the axes' width
    with figure(top + height + 0.45, page) as drawn:
        write_heading(drawn, "Force of the indenter along its stroke")
        axes = axes_at(drawn, (left, top, page - left - 0.65, height))
        straight = sum(not follows_load(curve.evaluation) for curve in curves)
        for curve, label in zip(curves, labels, strict=True):
            followed = follows_load(curve.evaluation)
            straight -= not followed
            axes.plot(
                curve.stroke,
                curve.force,
                color=(look := solver_look(curve.evaluation.solver)).colour,
                linestyle="-" if followed else (0, (3, 2)),
                # Straight lines often coincide: the later ones are narrower.
                linewidth=1.3 if followed else 1.2 + 1.4 * straight,
                marker=look.mark,
                markersize=3.6,
                label=label,
                zorder=3 if followed else 2,
            )
        if truth:
            end = truth.stroke[-1:], truth.force[-1:]
            axes.plot(*end, "x", ms=7, mew=1.8, color=MEASURED, label=true_label[0], zorder=4)
            axes.plot(truth.stroke, truth.force, color=MEASURED, lw=1.3, zorder=3)
        reach = (truth or curves[0]).stroke[-1]
        style: dict[str, Any] = {"ms": 4.5, "capsize": 2.5, "lw": 1.2, "zorder": 5}
        for place, ((each, (value, low, high)), label) in enumerate(zip(found, more, strict=True)):
            # Beside each other: the intervals of several solvers would hide each other.
            x, interval = reach * (1 - apart * (place + 1)), [[value - low], [high - value]]
            colour = solver_look(each.solver).colour
            axes.errorbar([x], [value], yerr=interval, fmt="s", label=label, color=colour, **style)
        every = [*curves, truth] if truth else curves
        axes.set_xlim(0, (1 + apart) * max(curve.stroke[-1] for curve in every))
        forces = np.concatenate([curve.force for curve in every] + [np.array(force) for _, force in found])
        axes.set_ylim(min(0.0, 1.05 * float(forces.min())), 1.05 * (float(forces.max()) or 1.0))
        axes.set_xlabel("stroke of the indenter, mm")
        axes.set_ylabel("force, N per mm of depth")
        axes.grid()
        whole = axes.secondary_yaxis(
            "right",
            functions=(lambda force: np.asarray(force) * depth, lambda force: np.asarray(force) / depth),
        )
        whole.set_ylabel(f"force for {depth:g} mm of depth, N")
        whole.spines["right"].set(visible=True, color=INK)
        legend_above(axes, page)
    return drawn


def _end_label(name: str, force: float) -> str:
    return f"{name}, {number(force, 3)} N"


def draw_force_track(
    times: FloatArray,
    forces: FloatArray,
    places: FloatArray,
    travel: FloatArray,
    back: BoolArray,
    *,
    depth: float,
) -> Figure:
    """Draw the force over time, and its place where there is at least a tenth of the largest force.

    Args:
        times: Shape (f,), s.
        forces: Force and the ends of its interval, shape (f, 3), N; nan and inf where it is not known.
        places: Abscissa of the contact and the ends of its interval, shape (f, 3), mm.
        travel: Of the markers, shape (f,), mm.
        back: Mask of the frames that are on the way back or held, shape (f,); if there is any, the force is
            drawn over the travel, too.
        depth: Of the finger, mm.
    """
    known = np.isfinite(forces).all(axis=1)
    pressed = known & (forces[:, 0] > 0.1 * forces[known, 0].max(initial=0.0))
    rows = [(times, forces, [known], "force, N"), (times, places, [pressed], "contact, x in mm")]
    if back.any():
        rows.append((travel, forces, [known & ~back, known & back], "force, N"))
    # inches
    head, height, gap, left, foot = 0.5, 1.1, 0.15, 0.65, 0.45
    tops = [head, head + height + gap, head + 2 * height + gap + foot]
    with figure(tops[len(rows) - 1] + height + foot, COLUMN) as drawn:
        note = f"for a depth of {depth:g} mm; bands: intervals of 95 %"
        write_heading(drawn, "Force of the indenter, by the markers", note)
        for row, (along, values, parts, label) in enumerate(rows):
            axes = axes_at(drawn, (left, tops[row], COLUMN - left - 0.15, height))
            for part, colour, name in zip(
                parts, (CONTACT, WAY_BACK), ("loading", "held, way back"), strict=False
            ):
                value, low, high = np.where(part[:, None], values, np.nan).T
                axes.fill_between(along, low, high, color=colour, alpha=0.25, linewidth=0)
                style = "-" if colour == CONTACT else (0, (4, 2))  # what they share is seen of both
                axes.plot(along, value, color=colour, linewidth=1.2, linestyle=style, label=name)
            axes.set_ylabel(label)
            axes.grid()
            first, last = float(np.nanmin(along)), float(np.nanmax(along))
            axes.set_xlim(first, max(last, first + 1e-3))
            if values is forces:
                top = float(forces[known, 2].max(initial=0.0)) or 1.0
                axes.set_ylim(1.05 * min(forces[known, 1].min(initial=0.0), 0.0), 1.05 * top)
            axes.tick_params(labelbottom=row > 0)
            axes.set_xlabel(("", "time, s", "travel of the markers, mm")[row])
        if back.any():
            axes.legend(loc="upper left")
    return drawn

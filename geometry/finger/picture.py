"""A finger's section as a picture: what is held, touched and marked."""

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path as Outline
from matplotlib.patheffects import withTickedStroke

from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.finger.parameters import SYMBOLS
from pinnray.geometry.section.section import Section
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.figure import BODY, COLUMN, CONTACT, INK, MEASURED, SMALL, Figure, body_figure

CELL, ROW = 1.55, 0.17
"""Width and height of a parameter below the section, inches."""

HATCHED = (withTickedStroke(angle=-120, spacing=4, length=1.5),)
"""Strokes on the outer side of a line."""


def plot_finger(
    finger: Finger, section: Section, place: Callable[[FloatArray], FloatArray], width: float | None = None
) -> Figure:
    """The section to scale: the clamp hatched, an arrow at the contact, numbered markers.

    Below it the parameters of the paper, if the finger has them.

    Args:
        finger: The finger.
        section: Its section in the frame of the picture.
        place: From the finger's frame into that of the picture, points of shape (n, 2), mm.
        width: Of the figure, inches; a journal's column if None.
    """
    page = width or COLUMN
    extent = float(np.ptp(section.bounds, axis=0).max())
    contact = finger.section.front_point(finger.contact_abscissa)
    tip, tail = place(np.stack([contact, contact + np.array([0.0, 0.09 * extent])]))
    hatched = section.bounds + 0.03 * extent * np.array([[-1], [1]])
    shown = np.concatenate([hatched, tip[None], tail[None]])
    parameters = [
        f"{SYMBOLS[symbol].replace('_', ' ')} {value}" for _, symbol, value in finger.facts() if symbol
    ]
    columns = int((page - 0.2) / CELL)
    rows = -(-len(parameters) // columns)
    with body_figure(shown, f"Finger “{finger.name}”", foot=ROW * rows, page=page) as (drawn, axes):
        for number, said in enumerate(parameters):
            row, column = divmod(number, columns)
            x, y = 0.2 + column * CELL, ROW * (rows - row - 0.5)
            drawn.text(x / page, y / drawn.get_figheight(), said, fontsize=SMALL, color=INK, va="center")
        draw_section(axes, section)
        for loop, which in section.named("base"):
            clamped = loop.along(which, np.linspace(0, 1, 60))
            axes.plot(*clamped.T, color=INK, lw=2.2, zorder=3)
            axes.plot(*clamped.T, color=INK, lw=0.6, zorder=2, path_effects=HATCHED)
        front = np.linspace(*finger.contact_ends, 30)
        touched = place(np.array([finger.section.front_point(x) for x in front]))
        axes.plot(*touched.T, color=CONTACT, lw=2.5, solid_capstyle="butt", zorder=4)
        axes.annotate("", tip, tail, arrowprops={"arrowstyle": "-|>", "color": CONTACT, "lw": 1.4}, zorder=5)
        text: dict[str, Any] = {"textcoords": "offset points", "fontsize": SMALL, "color": MEASURED}
        text |= {"zorder": 6, "path_effects": [patheffects.withStroke(linewidth=2, foreground="white")]}
        for number, centre in enumerate(place(finger.markers), start=1):
            axes.add_patch(Circle(tuple(centre), finger.marker_radius, fc=MEASURED, ec="none", zorder=4))
            # Not over the arrow's head: left of a marker that lies just before it.
            before = centre[0] <= tip[0] and np.linalg.norm(tip - centre) < 0.05 * extent
            aside, side = (-3, "right") if before else (3, "left")
            axes.annotate(str(number), centre, xytext=(aside, 3), ha=side, **text)
    return drawn


def draw_section(axes: Axes, shape: Section) -> None:
    """Draw the section, in mm, with an edge; cavities are empty."""
    rings = [loop.flattened() for loop in shape.loops]
    paths = [Outline(np.concatenate([ring, ring[:1]]), closed=True) for ring in rings]
    whole = Outline.make_compound_path(*paths)
    axes.add_patch(PathPatch(whole, fc=BODY, ec=INK, lw=0.9, zorder=1))

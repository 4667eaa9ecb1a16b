"""The layout that all pictures share: heading, axes by inches, arrows, legends."""

from collections.abc import Sequence

from matplotlib import patheffects
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.figure import INK, MUTED, SMALL, Figure

HALO = [patheffects.withStroke(linewidth=2.5, foreground="white")]
"""Keeps type and lines legible on anything."""

LEGEND_LINE = 0.17
"""Height of a line of a legend, inches."""


def write_heading(drawn: Figure, text: str, note: str = "") -> None:
    """Title at the top left of a figure, and under it, smaller, a note."""
    height = drawn.get_figheight()
    drawn.text(0.012, 1 - 0.06 / height, text, va="top", weight="bold", size=9.5, color=INK)
    if note:
        drawn.text(0.012, 1 - 0.25 / height, note, va="top", size=SMALL, color=MUTED, linespacing=1.3)


def axes_at(drawn: Figure, box: Sequence[float]) -> Axes:
    """Axes at left, top, width, height in inches, measured from the figure's top left corner."""
    left, top, width, height = box
    total_width, total_height = drawn.get_size_inches()
    bottom = 1 - (top + height) / total_height
    return drawn.add_axes((left / total_width, bottom, width / total_width, height / total_height))


def arrow(
    axes: Axes,
    start: Sequence[float] | FloatArray,
    end: Sequence[float] | FloatArray,
    *,
    style: str = "-|>,head_width=0.18,head_length=0.35",
    colour: str = INK,
    width: float = 1.0,
    gap: float = 0.0,
) -> None:
    """An arrow between two points in the axes' coordinates; `gap` is left at its end, points."""
    shape = {"arrowstyle": style, "color": colour, "lw": width, "shrinkA": 0, "shrinkB": gap}
    axes.annotate("", xy=tuple(end), xytext=tuple(start), arrowprops=shape, zorder=6)


def legend_below_heading(drawn: Figure, handles: Sequence[Artist], *, length: float, note: str = "") -> None:
    """A legend in one line below the heading, and a note on marks in the figure in the line below it.

    `length` is that of the handles, in heights of the type.
    """
    height = drawn.get_figheight()
    if note:
        drawn.text(0.012, 1 - (0.26 + LEGEND_LINE) / height, note, va="top", size=SMALL, color=INK)
    drawn.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(0.0, 1 - 0.24 / height),
        ncols=len(handles),
        columnspacing=1.2,
        handletextpad=0.5,
        borderaxespad=0.1,
        handlelength=length,
    )


def legend_columns(labels: Sequence[str]) -> int:
    """Two columns where they fit the width of the page, else one."""
    return 2 if max(map(len, labels)) <= 30 else 1


def legend_height(labels: Sequence[str]) -> float:
    """Height that `legend_above` needs for these labels, inches."""
    return LEGEND_LINE * -(-len(labels) // legend_columns(labels))


def legend_above(axes: Axes) -> None:
    """A legend above axes, at their left end."""
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(
        handles,
        labels,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.01),
        ncols=legend_columns(labels),
        handlelength=1.4,
        handletextpad=0.5,
        columnspacing=1.2,
        borderaxespad=0.0,
        borderpad=0.1,
        labelspacing=0.35,
    )

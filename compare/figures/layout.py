"""The layout that all pictures share: heading, axes by inches, arrows, legends."""

from collections.abc import Collection, Sequence
from textwrap import fill

from matplotlib import patheffects
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.figure import INK, MUTED, NARROW, SMALL, WIDTH, Figure

HALO = [patheffects.withStroke(linewidth=2.5, foreground="white")]
"""Keeps type and lines legible on anything."""

LEGEND_LINE = 0.17
"""Height of a line of a legend, inches."""

LETTERS = 15.5
"""Letters of small type in an inch, on average."""

TALLEST = 9.4
"""Height of a page of a journal, inches."""


def write_heading(drawn: Figure, text: str, note: str = "") -> None:
    """Title at the top left of a figure, and under it, smaller, a note."""
    height = drawn.get_figheight()
    drawn.text(0.012, 1 - 0.06 / height, text, va="top", weight="bold", size=9, color=INK)
    if note:
        drawn.text(0.012, 1 - 0.25 / height, note, va="top", size=SMALL, color=MUTED, linespacing=1.3)


def wrapped(text: str, width: float) -> str:
    """The text in lines of small type that fit a width in inches."""
    return fill(text, int(LETTERS * width))


def fitting(
    evaluations: Sequence[Evaluation], reference: Evaluation, room: int, chosen: Collection[str] = ()
) -> list[Evaluation]:
    """The evaluations that a page has room for: the reference, then those that converged, then others.

    Of these, first those that found the load. `chosen` are the names of those to choose from, all if empty.
    """
    found = [each for each in evaluations if not chosen or each.solver in chosen]
    first = sorted(
        found, key=lambda each: (each.solver != reference.solver, not each.converged, each.identified is None)
    )
    return [each for each in found if each in first[: max(room, 1)]]


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
) -> None:
    """An arrow between two points in the axes' coordinates."""
    shape = {"arrowstyle": style, "color": colour, "lw": width, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", xy=tuple(end), xytext=tuple(start), arrowprops=shape, zorder=6)


def head_height(width: float, handles: int, note: str = "") -> float:
    """Height of a heading with a legend and a note below it, inches; see `legend_below_heading`."""
    lines = 1 if width > NARROW else -(-handles // 2)
    return 0.28 + LEGEND_LINE * (lines + (note.count("\n") + 1 if note else 0))


def legend_below_heading(drawn: Figure, handles: Sequence[Artist], *, length: float, note: str = "") -> None:
    """A legend below the heading, and under it a note on marks in the figure.

    The legend has one line, or two columns on a narrow page. `length` is that of the handles, in heights of
    the type.
    """
    width, height = drawn.get_size_inches()
    if note:
        below = head_height(width, len(handles)) - 0.02
        drawn.text(0.012, 1 - below / height, note, va="top", size=SMALL, color=INK)
    drawn.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(0.0, 1 - 0.24 / height),
        ncols=len(handles) if width > NARROW else 2,
        columnspacing=1.2,
        handletextpad=0.5,
        borderaxespad=0.1,
        handlelength=length,
        labelspacing=0.3,
    )


def legend_columns(labels: Sequence[str], width: float = WIDTH) -> int:
    """Two columns where they fit the width of the page, inches, else one."""
    return 2 if max(map(len, labels)) <= 5.5 * width else 1


def legend_height(labels: Sequence[str], width: float = WIDTH) -> float:
    """Height that `legend_above` needs for these labels on a page of a width, inches."""
    return LEGEND_LINE * -(-len(labels) // legend_columns(labels, width))


def legend_above(axes: Axes, page: float = WIDTH) -> None:
    """A legend above axes, at their left end or that of a narrow page; pages have a width in inches."""
    handles, labels = axes.get_legend_handles_labels()
    place = axes.get_position()
    left = 0.0 if page > NARROW else (0.012 - place.x0) / place.width
    axes.legend(
        handles,
        labels,
        loc="lower left",
        bbox_to_anchor=(left, 1.01),
        ncols=legend_columns(labels, page),
        handlelength=1.4,
        handletextpad=0.5,
        columnspacing=1.2,
        borderaxespad=0.0,
        borderpad=0.1,
        labelspacing=0.35,
    )

"""A matplotlib figure with the project's look, which saves itself as PNG and shows itself in a notebook."""

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as MplFigure

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.atomic import write_bytes

if TYPE_CHECKING:
    from matplotlib.typing import RcKeyType

WIDTH = 5.5
"""Width of a figure for the screen, inches."""

COLUMN, PAGE = 85 / 25.4, 180 / 25.4
"""Widths of a journal's column and page, inches: type of `SMALL` is as large there."""

NARROW = 4.5
"""Width below which a figure has one column of panels, inches."""

SMALL = 8.1
"""Smallest type, points; journals print 7 at least."""

DPI = 300
NOTEBOOK_DPI = 150
LEFT, RIGHT, TITLE, BELOW = 0.55, 0.12, 0.3, 0.45
"""Margins of the axes of `body_figure`, inches."""
TALLEST = 0.8
"""Largest height of its axes over their width."""

INK = "#1a1a1a"
MUTED = "#767676"
BODY = "#e4e4e4"
CONTACT = "#d55e00"
MEASURED = "#d1006c"
"""Colour of measurements: occurs in none of the colour maps and for no solver."""

SETTINGS: "dict[RcKeyType, Any]" = {
    # A matplotlibrc of others in the working folder could have LaTeX read any file.
    **{name: value for name, value in mpl.rcParamsDefault.items() if not name.startswith("backend")},
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.titlesize": 9,
    "axes.labelsize": 8.5,
    "axes.edgecolor": INK,
    "axes.linewidth": 0.6,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.5,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.fontsize": SMALL,
    "legend.frameon": False,
    "mathtext.fontset": "dejavusans",
    "savefig.dpi": "figure",
    "pdf.fonttype": 42,  # letters as letters, as journals ask for
    "svg.hashsalt": "pinnray",  # the same file every time
}


OPTIONS: dict[str, dict[str, Any]] = {
    ".png": {"pil_kwargs": {"compress_level": 3}},  # quick
    ".pdf": {"metadata": {"CreationDate": None}},  # equal figures are equal files
    ".svg": {"metadata": {"Date": None}},
}
"""Options of a format, by its suffix."""


class Figure(MplFigure):
    """A matplotlib figure of a height and a width, inches, drawn with the project's settings wherever it is.

    It belongs to no pyplot window. Matplotlib gives such a figure no picture in a notebook: this one has it.
    """

    def __init__(self, height: float, width: float = WIDTH) -> None:
        super().__init__(figsize=(width, height), dpi=DPI, facecolor="white")
        FigureCanvasAgg(self)

    def draw(self, renderer: RendererBase) -> None:
        """Draw with the project's settings, whatever settings the process has."""
        with mpl.rc_context(SETTINGS):
            super().draw(renderer)

    def save(self, path: str | Path, formats: Collection[str] = ()) -> Path:
        """Write the figure atomically, and return the path.

        Args:
            path: Where to write, in the format of its suffix.
            formats: Others in which it is written beside it: `svg` or `pdf`.
        """
        path = Path(path)
        with mpl.rc_context(SETTINGS):
            for file in (path, *(path.with_suffix(f".{name}") for name in formats)):
                buffer = BytesIO()
                self.savefig(buffer, format=file.suffix.removeprefix("."), **OPTIONS.get(file.suffix, {}))
                write_bytes(file, buffer.getvalue())
        return path

    def _repr_png_(self) -> bytes:
        """The picture in a notebook."""
        buffer = BytesIO()
        with mpl.rc_context(SETTINGS):
            self.savefig(buffer, format="png", dpi=NOTEBOOK_DPI)
        return buffer.getvalue()


@contextmanager
def figure(height: float, width: float = WIDTH) -> Iterator[Figure]:
    """A new figure of a height and a width, inches, to be filled in the block with the project's settings."""
    with mpl.rc_context(SETTINGS):
        yield Figure(height, width)


@contextmanager
def body_figure(
    points: FloatArray, title: str, *, foot: float = 0.0, page: float = COLUMN
) -> Iterator[tuple[Figure, Axes]]:
    """A figure with axes in mm, of equal scale, around points of shape (n, 2), mm; wider than a tall body.

    Args:
        points: What must be visible.
        title: Of the figure.
        foot: Room below the axes, inches.
        page: Width of the figure, inches.
    """
    margin = 0.03 * float(np.ptp(points[:, 0]))
    (left, bottom), (right, top) = points.min(axis=0) - margin, points.max(axis=0) + margin
    beside = max(0.0, (top - bottom) / TALLEST - (right - left)) / 2
    left, right = left - beside, right + beside
    width = page - LEFT - RIGHT
    height = width * (top - bottom) / (right - left)
    lines = wrap(title, int(12.5 * width))
    total = TITLE + 0.15 * (len(lines) - 1) + height + BELOW + foot
    with figure(total, page) as drawn:
        axes = drawn.add_axes((LEFT / page, (BELOW + foot) / total, width / page, height / total))
        axes.set(xlim=(left, right), ylim=(bottom, top), xlabel="x, mm", ylabel="y, mm", aspect="equal")
        axes.set_title("\n".join(lines), weight="bold")
        yield drawn, axes

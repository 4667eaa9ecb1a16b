"""A matplotlib figure with the project's look, which saves itself as PNG and shows itself in a notebook."""

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as MplFigure

from geometry.atomic import atomic_path

if TYPE_CHECKING:
    from matplotlib.typing import RcKeyType

WIDTH = 5.5
"""Width of every figure, inches: type stays readable when a journal prints it in one column of 88 mm."""

DPI = 300
NOTEBOOK_DPI = 150

INK = "#1a1a1a"
MUTED = "#767676"
BODY = "#e4e4e4"
CONTACT = "#d55e00"
MEASURED = "#d1006c"
"""Colour of measurements: occurs in none of the colour maps and for no solver."""

_RC: "dict[RcKeyType, Any]" = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.titlesize": 9,
    "axes.labelsize": 8.5,
    "axes.edgecolor": INK,
    "axes.linewidth": 0.6,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "figure.titlesize": 10,
    "mathtext.fontset": "dejavusans",
    "savefig.dpi": "figure",
}


class Figure(MplFigure):
    """A matplotlib figure of `WIDTH` by a height in inches, drawn with the project's settings wherever it is.

    It belongs to no pyplot window. Matplotlib gives such a figure no picture in a notebook: this one has it.
    """

    def __init__(self, height: float) -> None:
        super().__init__(figsize=(WIDTH, height), dpi=DPI, facecolor="white")
        FigureCanvasAgg(self)

    def draw(self, renderer: RendererBase) -> None:
        """Draw with the project's settings, whatever those of the process are."""
        with mpl.rc_context(_RC):
            super().draw(renderer)

    def save(self, path: Path) -> Path:
        """Write the figure atomically, in the format of the path's suffix, and return the path."""
        quick = {"compress_level": 3} if path.suffix == ".png" else None
        with mpl.rc_context(_RC), atomic_path(path) as partial:
            self.savefig(partial, pil_kwargs=quick)
        return path

    def _repr_png_(self) -> bytes:
        """The picture in a notebook."""
        buffer = BytesIO()
        with mpl.rc_context(_RC):
            self.savefig(buffer, format="png", dpi=NOTEBOOK_DPI)
        return buffer.getvalue()


@contextmanager
def figure(height: float) -> Iterator[Figure]:
    """A new figure of a height in inches, to be filled in the block with the project's settings."""
    with mpl.rc_context(_RC):
        yield Figure(height)

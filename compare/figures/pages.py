"""All pictures in one PDF: a page each, ready for a paper, with its number and caption below."""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from textwrap import fill

from matplotlib import rc_context
from matplotlib.backends.backend_pdf import PdfPages

from pinnray.runtime.atomic import write_bytes
from pinnray.runtime.figure import INK, OPTIONS, SETTINGS, SMALL, Figure

COLUMNS = 92
"""Letters in a line of a caption."""

LINE = 0.155
"""Height of a line of a caption, inches."""


def write_pages(path: Path, drawings: Sequence[tuple[Figure, str, str]]) -> None:
    """Write the pictures as one PDF, atomically; each page is as large as its picture and caption.

    Args:
        path: Where to write.
        drawings: Each with its title and caption.
    """
    buffer = BytesIO()
    with rc_context(SETTINGS), PdfPages(buffer, **OPTIONS[".pdf"]) as pages:
        for number, (figure, title, told) in enumerate(drawings, start=1):
            words = f"Figure {number}. {title}. {' '.join(told.split())}"
            caption = fill(words.replace("$", r"\$"), COLUMNS)
            below = LINE * (caption.count("\n") + 1) + 0.25
            text = figure.text(
                0.012,
                -0.1 / figure.get_figheight(),
                caption,
                va="top",
                size=SMALL,
                color=INK,
                linespacing=1.35,
            )
            width, height = figure.get_size_inches()
            box = figure.bbox_inches.from_extents(0, -below, width, height)
            pages.savefig(figure, bbox_inches=box)
            text.remove()
    write_bytes(path, buffer.getvalue())

"""The pictures of a comparison; each function that draws one returns a `geometry.figure.Figure`.

Imports `compare.evaluation`. Matplotlib and PyVista are imported when the first picture is drawn, so that a
run without pictures starts fast.
"""

import gc
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path

from compare.evaluation.comparison import Results
from geometry.errors import UserError
from solvers.shared_work import SharedWork

FORMATS = ("svg", "pdf")
"""Formats of pictures for print."""


def check_formats(formats: Collection[str]) -> None:
    """Raise a `UserError` for a format of pictures that there is not."""
    if unknown := [kind for kind in formats if kind not in FORMATS]:
        raise UserError(f"there are no pictures as {unknown[0]}; besides PNG there are {', '.join(FORMATS)}")


@dataclass(frozen=True)
class Picture:
    """A picture that has been written as a PNG file."""

    path: Path
    title: str  # its subject, in a few words
    caption: str  # what a reader must know to read it, in sentences
    alt: str  # what it shows, in numbers, for those who cannot see it


def draw_all(
    folder: Path,
    comparison: Results,
    progress: Callable[[float, str], None] = lambda done, what: None,
    formats: Collection[str] = (),
) -> list[Picture]:
    """Write every picture of a comparison as PNG, and in other `FORMATS`, in the order of a report.

    With `pdf` there is also `all.pdf`: a page for each picture, with its caption below.

    `progress` is called before every picture with the share done, from 0 to 1, and what comes next.
    """
    from compare.figures.gallery import GALLERY
    from compare.figures.pages import write_pages

    pictures: list[Picture] = []
    drawings = []
    # Figures have so many objects that a tenth of the time went into collecting garbage among older ones.
    gc.freeze()
    try:
        with SharedWork().used():
            for number, (name, (what, draw)) in enumerate(GALLERY.items()):
                progress(number / len(GALLERY), what)
                if drawing := draw(comparison):
                    path = drawing.figure.save(folder / f"{name}.png", formats)
                    pictures.append(Picture(path, drawing.title, drawing.caption, drawing.alt))
                    drawings.append((drawing.figure, drawing.title, drawing.caption))
        if "pdf" in formats:
            write_pages(folder / "all.pdf", drawings)
    finally:
        gc.unfreeze()
    progress(1.0, "pictures drawn")
    return pictures

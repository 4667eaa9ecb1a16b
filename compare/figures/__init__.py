"""The pictures of a comparison; each function that draws one returns a `geometry.figure.Figure`.

Imports `comparison.evaluation`. Matplotlib is imported when the first picture is drawn, so that a run
without pictures starts fast.
"""

import gc
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path

from pinnray.comparison.evaluation.comparison import Results
from pinnray.runtime.errors import UserError
from pinnray.solvers.shared_work import SharedWork

FORMATS = ("svg", "pdf")
"""Formats of pictures for print."""


def check_formats(formats: Collection[str]) -> None:
    """Raise a `UserError` for a format of pictures that there is not."""
    if unknown := [kind for kind in formats if kind not in FORMATS]:
        raise UserError(f"there are no pictures as {unknown[0]}; besides PNG there are {', '.join(FORMATS)}")


def page_width(width: float | None, formats: Collection[str] = ()) -> float:
    """A picture's width in inches from one in mm; None: that of a screen, or for print of a journal's page.

    Raises:
        UserError: If type of the usual size has no room, or no page is so wide.
    """
    from pinnray.runtime.figure import PAGE, WIDTH

    if width is not None and not 80 <= width <= 200:
        raise UserError(
            f"a picture's width of {width:g} mm is not within 80 to 200 mm; a journal's column has 85 mm, "
            "its page 180 mm"
        )
    if width is None:
        return PAGE if formats else WIDTH
    return width / 25.4


@dataclass(frozen=True)
class Picture:
    """A picture that has been written as a PNG file."""

    path: Path
    title: str  # its subject, in a few words
    caption: str  # what a reader must know to read it, in sentences


def draw_all(
    folder: Path,
    comparison: Results,
    progress: Callable[[float, str], None] = lambda done, what: None,
    formats: Collection[str] = (),
    width: float | None = None,
) -> list[Picture]:
    """Write every picture of a comparison as PNG, and in other `FORMATS`, in the order of a report.

    Pictures have the width of `page_width`, or one in mm.
    `progress` is called before every picture with the share done, from 0 to 1, and what comes next.
    """
    from pinnray.comparison.figures.gallery import GALLERY

    pictures, page, work = [], page_width(width, formats), SharedWork()
    # Figures have so many objects that a tenth of the time went into collecting garbage among older ones.
    gc.freeze()
    try:
        for number, (name, (what, draw)) in enumerate(GALLERY.items()):
            progress(number / len(GALLERY), what)
            with work.used():  # fields on the same mesh are rendered once
                drawing = draw(comparison, page)
            if drawing:
                path = drawing.figure.save(folder / f"{name}.png", formats)
                pictures.append(Picture(path, drawing.title, drawing.caption))
    finally:
        gc.unfreeze()
    progress(1.0, "pictures drawn")
    return pictures

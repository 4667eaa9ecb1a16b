"""The pictures of a comparison; each function that draws one returns a `geometry.figure.Figure`.

Imports `compare.evaluation`. Matplotlib and PyVista are imported when the first picture is drawn, so that a
run without pictures starts fast.
"""

import gc
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from compare.evaluation.comparison import Comparison
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
    """A picture that has been written.

    Attributes:
        path: The PNG file.
        title: Its subject, in a few words.
        caption: What a reader must know to read it, in sentences.
        alt: What it shows, in numbers, for those who cannot see it.
    """

    path: Path
    title: str
    caption: str
    alt: str


def draw_all(
    folder: Path,
    comparison: Comparison,
    progress: Callable[[float, str], None] = lambda done, what: None,
    formats: Collection[str] = (),
) -> list[Picture]:
    """Write every picture of a comparison as PNG, in the order of a report.

    Args:
        folder: Where to write.
        comparison: The comparison.
        progress: Called before every picture with the share done, from 0 to 1, and what comes next.
        formats: Others in which they are written too, of `FORMATS`.
    """
    from compare.figures.gallery import DRAWINGS

    pictures: list[Picture] = []
    with SharedWork().used(), _older_objects_kept():
        for number, (name, (what, draw)) in enumerate(DRAWINGS.items()):
            progress(number / len(DRAWINGS), what)
            if (drawing := draw(comparison)) is None:
                continue
            path = drawing.figure.save(folder / f"{name}.png", formats)
            pictures.append(Picture(path, drawing.title, drawing.caption, drawing.alt))
    progress(1.0, "pictures drawn")
    return pictures


@contextmanager
def _older_objects_kept() -> Iterator[None]:
    """Let the garbage collector pass over all that is older than the block.

    Figures are made of so many objects that a tenth of their time went into looking through everything else.
    """
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()

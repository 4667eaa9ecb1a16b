"""The pictures of a comparison; each function that draws one returns a `geometry.figure.Figure`.

Imports `comparison.evaluation`. Matplotlib and PyVista are imported when the first picture is drawn, so that
a
run without pictures starts fast.
"""

import gc
from collections.abc import Callable, Collection, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pinnray.comparison.evaluation.comparison import Results
from pinnray.runtime.errors import UserError
from pinnray.runtime.processes.child import ProcessFailed, end_with_parent
from pinnray.runtime.processes.pool import Pool
from pinnray.solvers.shared_work import SharedWork

if TYPE_CHECKING:
    from pinnray.runtime.figure import Figure

FORMATS = ("svg", "pdf")
"""Formats of pictures for print."""

LARGE = 5000
"""Nodes of a mesh from which pictures of fields take longer than a process that draws them takes to start."""

BESIDE = ("marker_errors", "differences")
"""Pictures that another process draws besides those of fields: half of the work in all."""


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


@dataclass(frozen=True)
class Beside:
    """Pictures that another process draws."""

    names: Collection[str]
    drawn: Future["dict[str, Picture] | ProcessFailed"]

    def pictures(self) -> dict[str, Picture]:
        """The pictures by their names; none of a process that failed, which this one then draws."""
        answer = self.drawn.result()
        return {} if isinstance(answer, ProcessFailed) else answer


@contextmanager
def pictures_beside(
    folder: Path, comparison: Results, formats: Collection[str], pool: Pool | None
) -> Iterator[Beside | None]:
    """Begin half of the pictures in a second process, if there is a pool and they take longer than it.

    One PDF of all pictures needs them here.
    """
    if not pool or "pdf" in formats or len(comparison.mesh.points) < LARGE:
        yield None
        return
    from pinnray.comparison.figures.fields import QUANTITIES

    names = [*(quantity.name for quantity in QUANTITIES), *BESIDE]
    task = (folder, comparison, names, formats)
    with pool.beside(_drawn_for_parent, task) as drawn:
        yield Beside(names, drawn)


def _drawn_for_parent(
    task: tuple[Path, Results, Collection[str], Collection[str]], report: Callable[..., None]
) -> dict[str, Picture]:
    end_with_parent()
    return {name: picture for name, picture, _ in _drawn(*task)}


def draw_all(
    folder: Path,
    comparison: Results,
    progress: Callable[[float, str], None] = lambda done, what: None,
    formats: Collection[str] = (),
    beside: Beside | None = None,
) -> list[Picture]:
    """Write every picture of a comparison as PNG, and in other `FORMATS`, in the order of a report.

    With `pdf` there is also `all.pdf`: a page for each picture, with its caption below. Those `beside` come
    from another process.

    `progress` is called before every picture with the share done, from 0 to 1, and what comes next.
    """
    from pinnray.comparison.figures.gallery import GALLERY
    from pinnray.comparison.figures.pages import write_pages

    ours = [name for name in GALLERY if beside is None or name not in beside.names]
    drawn = _drawn(folder, comparison, ours, formats, progress)
    pictures = {name: picture for name, picture, _ in drawn}
    if "pdf" in formats:
        write_pages(folder / "all.pdf", [(figure, each.title, each.caption) for _, each, figure in drawn])
    if beside is not None:
        progress(0.9, "pictures of the second process")
        theirs = beside.pictures()
        missing = [name for name in beside.names if not theirs]
        pictures |= theirs | {name: each for name, each, _ in _drawn(folder, comparison, missing, formats)}
    progress(1.0, "pictures drawn")
    return [pictures[name] for name in GALLERY if name in pictures]


def _drawn(
    folder: Path,
    comparison: Results,
    names: Collection[str],
    formats: Collection[str],
    progress: Callable[[float, str], None] = lambda done, what: None,
) -> "list[tuple[str, Picture, Figure]]":
    """Draw and write the pictures of these names; none of a name that the comparison has nothing for."""
    from pinnray.comparison.figures.gallery import GALLERY

    drawn = []
    # Figures have so many objects that a tenth of the time went into collecting garbage among older ones.
    gc.freeze()
    try:
        with SharedWork().used():
            for number, name in enumerate(names):
                what, draw = GALLERY[name]
                progress(number / len(names), what)
                if drawing := draw(comparison):
                    path = drawing.figure.save(folder / f"{name}.png", formats)
                    picture = Picture(path, drawing.title, drawing.caption, drawing.alt)
                    drawn.append((name, picture, drawing.figure))
    finally:
        gc.unfreeze()
    return drawn

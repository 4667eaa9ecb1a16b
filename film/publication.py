"""Lines about the frames of a live film, shown or published as JSON: markers, and the indenter's force."""

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from typing import Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field
from rich.live import Live
from rich.text import Text

from pinnray.film.force_estimate import LiveForce
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.runtime.tables import Cell
from pinnray.vision.frames.frame import Frame
from pinnray.vision.tracking.frame_tracker import FrameDetections

Point = tuple[float, float]
Watch = Callable[[Frame, FrameDetections], None]


class FrameLine(BaseModel):
    """A frame of a film: one line of JSON."""

    model_config = ConfigDict(frozen=True, serialize_by_alias=True, validate_by_name=True)

    version: Literal[2] = Field(default=2, alias="schema")  #: Keys may be added to 2, not renamed or removed
    frame: int  #: Number of the frame
    time_s: float  #: Its time in the film
    markers_mm: tuple[Point | None, ...]  #: Places (x, y) of the markers; null where one is not seen
    moved_mm: tuple[Point | None, ...]  #: Displacements (u, v) since the first frame
    #: The newest force, by the columns of `force.csv`; null before there is one, and without one to follow
    force: dict[str, Cell | None] | None
    status: str  #: Hidden markers in words; empty if all are seen

    @classmethod
    def of(
        cls,
        frame: Frame,
        detections: FrameDetections,
        start: FloatArray,
        force: dict[str, Cell | None] | None,
    ) -> Self:
        """The line of a frame.

        Args:
            frame: The frame.
            detections: Its markers.
            start: Places of the markers in the first frame, shape (m, 2), mm.
            force: The newest one, if there is any.
        """
        seen = np.isfinite(detections.markers.radii)
        hidden = ", ".join(str(number + 1) for number in np.flatnonzero(~seen))
        return cls(
            frame=frame.number,
            time_s=frame.time,
            markers_mm=_points(detections.places, seen),
            moved_mm=_points(detections.places - start, seen),
            force=force,
            status=f"hidden: marker {hidden}" if hidden else "",
        )


def frame_lines(force: LiveForce | None, *sinks: Callable[[FrameLine], None]) -> Watch:
    """What to give each frame of a film to: its line, with the newest force, goes to every sink.

    Args:
        force: Follows the force, if anything does.
        sinks: Such as a `Publisher` or `shown_line`.
    """
    start: FloatArray | None = None

    def watch(frame: Frame, detections: FrameDetections) -> None:
        nonlocal start
        start = detections.places if start is None else start
        if force is not None:
            force.watch(frame, detections)
        line = FrameLine.of(frame, detections, start, force.newest_row() if force else None)
        for sink in sinks:
            sink(line)

    return watch


def shown_line(live: Live, force: LiveForce | None) -> Callable[[FrameLine], None]:
    """A function that shows the displacements of a frame, mm, and below them the newest force in words."""

    def show(line: FrameLine) -> None:
        cells = ["–" if moved is None else "{:+.2f},{:+.2f}".format(*moved) for moved in line.moved_mm]
        lines = [f"{line.time_s:8.2f} s  {'  '.join(cells)}", *([force.line()] if force else [])]
        live.update(Text("\n".join(lines), no_wrap=True, overflow="ellipsis"))

    return show


class Publisher(AbstractContextManager["Publisher"]):
    """Writes a line of JSON for each frame as it is tracked.

    Args:
        target: A file, a named pipe, which is opened when its reader does so, or - for the standard output.

    Raises:
        UserError: If the file cannot be written.
    """

    def __init__(self, target: str) -> None:
        self._target = target
        try:
            self._file = sys.stdout if target == "-" else Path(target).open("w", encoding="utf-8")  # noqa: SIM115
        except OSError as error:
            raise UserError(f"{target} cannot be written: {error.strerror}") from None

    def __exit__(self, *error: object) -> None:
        if self._file is not sys.stdout:
            with suppress(BrokenPipeError):  # which `__call__` has told of
                self._file.close()

    def __call__(self, line: FrameLine) -> None:
        """Write a line at once."""
        try:
            print(line.model_dump_json(), file=self._file, flush=True)
        except BrokenPipeError:
            raise UserError(f"the reader of {self._target} has gone") from None


def _points(places: FloatArray, seen: FloatArray) -> tuple[Point | None, ...]:
    return tuple((x, y) if known else None for (x, y), known in zip(places.tolist(), seen, strict=True))

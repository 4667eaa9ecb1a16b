"""Lines of JSON about the frames of a live film, for other programs: markers, and the indenter's force."""

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from typing import Literal, Self, TextIO

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

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


class Publisher(AbstractContextManager["Publisher"]):
    """Writes a line for each frame as it is tracked.

    Args:
        target: A file, a named pipe, which is opened when its reader does so, or - for the standard output.
        force: Follows the force, if anything does.

    Raises:
        UserError: If the file cannot be written.
    """

    def __init__(self, target: str, force: LiveForce | None = None) -> None:
        self._target, self._force = target, force
        self._start: FloatArray | None = None
        self._file: TextIO | None = None

    def __enter__(self) -> Self:
        try:
            self._file = sys.stdout if self._target == "-" else Path(self._target).open("w", encoding="utf-8")
        except OSError as error:
            raise UserError(f"{self._target} cannot be written: {error.strerror}") from None
        return self

    def __exit__(self, *error: object) -> None:
        if self._file is not None and self._file is not sys.stdout:
            with suppress(BrokenPipeError):  # which `_write` has told of
                self._file.close()

    def after(self, watch: Watch) -> Watch:
        """What a frame is given to: first to `watch`, then it is published."""

        def see(frame: Frame, detections: FrameDetections) -> None:
            watch(frame, detections)
            if self._start is None:
                self._start = detections.places
            newest = self._force.newest_row() if self._force else None
            self._write(FrameLine.of(frame, detections, self._start, newest).model_dump_json())

        return see

    def _write(self, line: str) -> None:
        assert self._file is not None
        try:
            print(line, file=self._file, flush=True)
        except BrokenPipeError:
            raise UserError(f"the reader of {self._target} has gone") from None


def _points(places: FloatArray, seen: FloatArray) -> tuple[Point | None, ...]:
    return tuple((x, y) if known else None for (x, y), known in zip(places.tolist(), seen, strict=True))

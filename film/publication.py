"""Lines of JSON about the frames of a live film, for other programs: markers, and the indenter's force."""

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from math import isfinite
from pathlib import Path
from typing import Literal, Self, TextIO

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from pinnray.film.force_estimate import FrameForce, LiveForce
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.frames.frame import Frame
from pinnray.vision.tracking.frame_tracker import FrameDetections

Point = tuple[float, float]
Watch = Callable[[Frame, FrameDetections], None]


class PublishedForce(BaseModel):
    """The newest force: of the line's frame, or of an earlier one, as finding it takes time."""

    model_config = ConfigDict(frozen=True)

    frame: int  #: Whose force it is
    time_s: float  #: Of that frame
    N_per_mm: float | None  #: Size of the force per depth; null without an estimate
    N_per_mm_low: float  #: Ends of its 95 % interval
    N_per_mm_high: float | None  #: Null without a bound
    x_N_per_mm: float | None  #: Components of the force on the finger: along it,
    y_N_per_mm: float | None  #: and out of its front face
    position_mm: float | None  #: Abscissa on the drawn front at which it acts
    position_low_mm: float  #: Ends of its 95 % interval
    position_high_mm: float
    status: str  #: Remarks in words; empty if there are none

    @classmethod
    def of(cls, found: FrameForce) -> Self:
        """The force of a frame."""
        reading = found.reading
        x, y = (_known(each) for each in reading.force.tolist())
        return cls(
            frame=found.frame,
            time_s=found.time,
            N_per_mm=_known(reading.size),
            N_per_mm_low=reading.low,
            N_per_mm_high=_known(reading.high),
            x_N_per_mm=x,
            y_N_per_mm=y,
            position_mm=_known(reading.position),
            position_low_mm=reading.position_low,
            position_high_mm=reading.position_high,
            status=reading.status,
        )


class FrameLine(BaseModel):
    """A frame of a film: one line of JSON."""

    model_config = ConfigDict(frozen=True, serialize_by_alias=True, validate_by_name=True)

    version: Literal[1] = Field(default=1, alias="schema")  #: Keys may be added to 1, not renamed or removed
    frame: int  #: Number of the frame
    time_s: float  #: Its time in the film
    markers_mm: tuple[Point | None, ...]  #: Places (x, y) of the markers; null where one is not seen
    moved_mm: tuple[Point | None, ...]  #: Displacements (u, v) since the first frame
    force: PublishedForce | None  #: Null before the first estimate, and without --force
    status: str  #: Hidden markers in words; empty if all are seen

    @classmethod
    def of(
        cls, frame: Frame, detections: FrameDetections, start: FloatArray, force: FrameForce | None
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
            force=None if force is None else PublishedForce.of(force),
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
            newest = self._force.forces[-1] if self._force and self._force.forces else None
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


def _known(value: float) -> float | None:
    return float(value) if isfinite(value) else None

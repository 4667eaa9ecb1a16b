"""A film while it is tracked: the force in the newest frame, and a line for every frame."""

import json
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import numpy as np

from pinnray.film.force_estimate import FrameForce, force_line, force_row
from pinnray.film.loading_path import LoadingPath
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.identification.tracker import ForceTracker
from pinnray.vision.frames.frame import Frame
from pinnray.vision.tracking.frame_tracker import FrameDetections

STILL = 5.0
"""Distance of a marker from its mean so far, in standard deviations, within which the finger is at rest."""
LEAST = 0.02
"""The same in mm, for films without noise."""


class LiveForce:
    """Follows the force in a thread while a film is tracked: always in the newest frame.

    Frames that come while the force of an earlier one is sought are passed over, but for the newest of them.
    An error of the estimate is raised when the next frame comes. Displacements are those since the frames
    before the first motion.

    Args:
        tracker: With the design's markers.
        depth: Of the finger, mm.
        loss: Of the material.

    Attributes:
        passed_over: Number of frames that have no force.
    """

    def __init__(self, tracker: ForceTracker, depth: float, loss: float) -> None:
        self.passed_over = 0
        self._tracker, self.depth, self._path = tracker, depth, LoadingPath(loss)
        self._thread = ThreadPoolExecutor(max_workers=1)
        self._forces: list[Future[FrameForce]] = []
        self._moves = False
        # Over the frames before the markers move: sum of their places, mm, and number of frames in which each
        # was seen. The first frame gives them the shapes (m, 2) and (m, 1).
        self._sum, self._count = np.zeros((1, 2)), np.zeros((1, 1))

    def watch(self, frame: Frame, detections: FrameDetections) -> None:
        """Take a frame; see `pinnray.vision.tracking.tracker.track`."""
        places, discs = detections.places, detections.markers
        seen = np.isfinite(discs.radii)
        per_mm = np.linalg.norm(np.ptp(detections.guesses, axis=0)) / np.linalg.norm(np.ptp(places, axis=0))
        noise = np.sqrt(np.nan_to_num(np.trace(discs.covariances, axis1=1, axis2=2) / 2)) / per_mm
        self._watch_rest(np.where(seen[:, None], places, np.nan), noise)
        known, count = seen & (self._count > 0).all(axis=1), np.maximum(self._count, 1)
        deviations = np.repeat(noise[:, None] * np.sqrt(1 + 1 / count), 2, axis=1)
        moved = np.where(known[:, None], places - self._rest, 0.0)
        loading = self._path.follow(frame.time, moved, deviations, known)
        if self._forces and self._forces[-1].cancel():
            self._forces.pop()
            self.passed_over += 1
        tracked = time.perf_counter()

        def answer() -> FrameForce:
            reading = self._path.widened(self._tracker.update(moved, deviations, known), loading)
            return FrameForce(frame.number, frame.time, reading, time.perf_counter() - tracked, loading)

        self._forces.append(self._thread.submit(answer))

    def newest(self) -> FrameForce | None:
        """The last force that was found; None before there is one."""
        return next((each.result() for each in reversed(self._forces) if each.done()), None)

    def finished(self) -> list[FrameForce]:
        """All forces, when that of the last frame is found."""
        self._thread.shutdown()
        return [each.result() for each in self._forces]

    @property
    def _rest(self) -> FloatArray:
        """Mean of the markers in the frames before they move, shape (m, 2), mm; nan for one not seen."""
        return np.where(self._count > 0, self._sum / np.maximum(self._count, 1), np.nan)

    def _watch_rest(self, places: FloatArray, noise: FloatArray) -> None:
        """Add a frame to the rest unless markers move: places (m, 2), mm, nan if hidden; deviations (m,)."""
        away = np.linalg.norm(places - self._rest, axis=1)
        self._moves |= bool((away > np.maximum(STILL * noise, LEAST)).any())
        if not self._moves:
            self._sum = self._sum + np.nan_to_num(places)
            self._count = self._count + np.isfinite(places).all(axis=1, keepdims=True)


def frame_lines(force: LiveForce | None, *, publish: bool) -> Callable[[Frame, FrameDetections], str]:
    """A function that takes each frame of a film and returns words on it, to be shown.

    The words are the newest force or, without one to follow, the displacements, mm.

    Args:
        force: Follows the force, if anything does.
        publish: Whether to print a line of JSON on the standard output, too.
    """
    start: FloatArray | None = None

    def watch(frame: Frame, detections: FrameDetections) -> str:
        nonlocal start
        start = detections.places if start is None else start
        if force is not None:
            force.watch(frame, detections)
        newest = None if force is None else force.newest()
        line = frame_line(frame, detections, start)
        if publish:
            row = None if force is None or newest is None else force_row(newest, force.depth)
            print(json.dumps(line | {"force": row}), flush=True)
        if force is None:
            return " ".join("–" if uv is None else "{:+.2f},{:+.2f}".format(*uv) for uv in line["moved_mm"])
        return force_line(newest, force.depth) if newest else "force: not yet"

    return watch


def frame_line(frame: Frame, detections: FrameDetections, start: FloatArray) -> dict[str, Any]:
    """The markers in a frame by the keys of a published line; keys may be added, not renamed or removed.

    Args:
        frame: The frame.
        detections: Its markers.
        start: Places of the markers in the first frame, shape (m, 2), mm.
    """
    seen = np.isfinite(detections.markers.radii)
    hidden = ", ".join(str(number + 1) for number in np.flatnonzero(~seen))
    places, moved = (
        [list(at) if known else None for at, known in zip(points.tolist(), seen, strict=True)]
        for points in (detections.places, detections.places - start)
    )
    return {
        "schema": 2,
        "frame": frame.number,
        "time_s": frame.time,
        "markers_mm": places,
        "moved_mm": moved,
        "status": f"hidden: marker {hidden}" if hidden else "",
    }

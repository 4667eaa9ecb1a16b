"""The force of the indenter in the frames of a film, from its markers: afterwards, or live."""

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Generic, NamedTuple, Self, TypeVar

import numpy as np
from rich.table import Table

from pinnray.comparison.figures.force_charts import draw_force_track
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.runtime.tables import Cell, terminal_table, write_csv
from pinnray.solvers.identification.tracker import ForceReading, ForceTracker
from pinnray.solvers.problem import Material, Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solver import Progress
from pinnray.vision.frames.frame import Frame
from pinnray.vision.tracking.frame_tracker import FrameDetections
from pinnray.vision.tracking.trajectories import Tracking

Newest = TypeVar("Newest")


class NewestOnly(Generic[Newest]):
    """Does work on items in a thread: always on the newest one, on none twice; the others are passed over.

    A context manager, at whose end the last item is worked on. An error in the work is raised by the next
    `put` or `finish`, and no work is done after it. `finish` may be called before the end; no item may follow
    it.
    """

    def __init__(self, work: Callable[[Newest], None]) -> None:
        self.passed_over = 0  #: Number of items that were not worked on.
        self._work = work
        self._thread = ThreadPoolExecutor(max_workers=1)
        self._last: Future[None] | None = None
        self._error: BaseException | None = None

    def put(self, item: Newest) -> None:
        """Leave an item to be worked on, in place of one that waits."""
        self._raise()
        if self._last is not None and self._last.cancel():
            self.passed_over += 1
        self._last = self._thread.submit(self._worked, item)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._thread.shutdown()
        if kind is None:
            self.finish()

    def finish(self) -> None:
        """Wait until the last item is done."""
        self._thread.shutdown()
        self._raise()

    def _worked(self, item: Newest) -> None:
        """In the thread: do the work, or keep its error for `_raise`."""
        if self._error is None:
            try:
                self._work(item)
            except BaseException as error:
                self._error = error

    def _raise(self) -> None:
        if self._error is not None:
            raise self._error


MESH = MeshSettings(size=1.0, corner_size=0.2)
"""Elements: the default finger is a thousandth stiffer with them than with those of 0.25 mm."""
STILL = 5.0
"""Distance of a marker from its mean so far, in standard deviations, within which the finger is at rest."""
LEAST = 0.02
"""The same in mm, for films without noise."""


class FrameForce(NamedTuple):
    """The force in a frame.

    Attributes:
        frame: Its number.
        time: Of the frame, s.
        reading: The force with its intervals.
        delay: Time from the end of the frame's tracking to the force, s.
    """

    frame: int
    time: float
    reading: ForceReading
    delay: float


def force_tracker(mesh: TriangleMesh, material: Material, points: FloatArray, radius: float) -> ForceTracker:
    """The force tracker of a finger.

    Args:
        mesh: Of the finger.
        material: If its law is the linear one, the neo-Hookean one is taken.
        points: Markers at rest, shape (m, 2), mm.
        radius: Of the markers, mm.

    Raises:
        UserError: If DOLFINx is missing.
    """
    make_solver("fem-id")  # or says which library is missing
    from pinnray.solvers.fem.identification import fem_force_tracker

    law = "neo-hookean" if material.law == "linear" else material.law
    problem = Problem(mesh, material.model_copy(update={"law": law}))
    return fem_force_tracker(problem, points, radius)


def forces_of(tracking: Tracking, tracker: ForceTracker, progress: Progress) -> list[FrameForce]:
    """The force in every frame of a track, against the mean of its frames at rest.

    Args:
        tracking: Of the film.
        tracker: With the markers of the track.
        progress: Told of the frames.
    """
    rest, places = tracking.rest_positions[0], tracking.positions
    found = []
    for number, (when, at, noise) in enumerate(
        zip(tracking.times.tolist(), places, tracking.covariances, strict=True)
    ):
        seen = np.isfinite(rest + at).all(axis=1)
        deviations = np.zeros_like(at)
        if seen.any():
            covariance = tracking.plane.displacement_covariance(
                rest[seen], at[seen], tracking.initial.covariances[seen], noise[seen]
            )
            deviations[seen] = np.sqrt(np.diag(covariance)).reshape(-1, 2)
        reading = tracker.update(np.where(seen[:, None], at - rest, 0.0), deviations, seen)
        found.append(FrameForce(number, when, reading, reading.seconds))
        progress((number + 1) / len(places), f"frame {number + 1}, {reading.size:.3g} N/mm")
    return found


class LiveRate(NamedTuple):
    """The pace of a live estimate.

    Attributes:
        passed_over: Number of frames that came before the force of an earlier one was found, and have none.
        rate: Forces a second.
    """

    passed_over: int
    rate: float


class _Markers(NamedTuple):
    """The markers of a live frame: what `ForceTracker.update` takes, and when they were tracked, s."""

    frame: int
    time: float
    displacements: FloatArray
    deviations: FloatArray
    visible: BoolArray
    tracked: float


class LiveForce(NewestOnly[_Markers]):
    """Follows the force while a film is tracked: in the newest frame, as fast as it can.

    A context manager around the tracking, which an error of the estimate ends at the next frame.
    Displacements are those since the frames before the first motion.

    Args:
        tracker: With the design's markers.
        depth: Of the finger, mm.

    Attributes:
        forces: What was found so far.
    """

    def __init__(self, tracker: ForceTracker, depth: float) -> None:
        super().__init__(self._answer)
        self._tracker, self._depth = tracker, depth
        self.forces: list[FrameForce] = []
        self._started = self._answered = 0.0  # when the first and the last force were found, s
        self._moves = False
        # Over the frames before the markers move: sum of their places, mm, and number of frames in which each
        # was seen. The first frame gives them the shapes (m, 2) and (m, 1).
        self._sum, self._count = np.zeros((1, 2)), np.zeros((1, 1))

    @property
    def live_rate(self) -> LiveRate:
        """How it kept up with the film."""
        spent = self._answered - self._started
        rate = (len(self.forces) - 1) / spent if spent else 0.0
        return LiveRate(self.passed_over, rate)

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
        self.put(_Markers(frame.number, frame.time, moved, deviations, known, time.perf_counter()))

    def line(self) -> str:
        """The last force in words."""
        return force_line(self.forces[-1], self._depth) if self.forces else "force: not yet"

    def newest_row(self) -> dict[str, Cell | None] | None:
        """The last force by the columns of `force.csv`; None before there is one."""
        return force_row(self.forces[-1], self._depth) if self.forces else None

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

    def _answer(self, markers: _Markers) -> None:
        reading = self._tracker.update(markers.displacements, markers.deviations, markers.visible)
        self._answered = time.perf_counter()
        self._started = self._started or self._answered
        self.forces.append(FrameForce(markers.frame, markers.time, reading, self._answered - markers.tracked))


def force_line(force: FrameForce, depth: float) -> str:
    """A force in words: N and N/mm with the interval, place, delay, remarks."""
    reading = force.reading
    parts = [f"{force.time:8.2f} s  no force"]
    if np.isfinite(reading.size):
        parts = [
            f"{force.time:8.2f} s  force {reading.size * depth:.2f} N ({reading.low * depth:.2f} to "
            f"{reading.high * depth:.2f}), {reading.size:.3g} N/mm, at x = {reading.position:.1f} mm "
            f"({reading.position_low:.1f} to {reading.position_high:.1f})"
        ]
    parts.append(f"after {1000 * force.delay:.0f} ms")
    return "; ".join(filter(None, [*parts, reading.status]))


def force_row(force: FrameForce, depth: float) -> dict[str, Cell | None]:
    """The force in a frame by the columns of `force.csv`; None where there is no estimate or no bound."""
    reading = force.reading
    x, y = reading.force
    numbers = {
        "force_N": reading.size * depth,
        "force_low_N": reading.low * depth,
        "force_high_N": reading.high * depth,
        "N_per_mm": reading.size,
        "N_per_mm_low": reading.low,
        "N_per_mm_high": reading.high,
        "force_x_N_per_mm": x,
        "force_y_N_per_mm": y,
        "position_mm": reading.position,
        "position_low_mm": reading.position_low,
        "position_high_mm": reading.position_high,
        "inflation": reading.inflation,
    }
    row: dict[str, Cell | None] = {"frame": force.frame, "time_s": force.time}
    row |= {name: float(value) if np.isfinite(value) else None for name, value in numbers.items()}
    row |= {"equilibria": reading.evaluations, "seconds": reading.seconds, "delay_s": force.delay}
    return row | {"remark": reading.status}


def write_forces(folder: Path, forces: Sequence[FrameForce], depth: float) -> None:
    """Write `force.csv` and the picture `force.png` into a folder."""
    write_csv(folder / "force.csv", [force_row(force, depth) for force in forces])
    readings = [force.reading for force in forces]
    times = np.array([force.time for force in forces])
    sizes, places = (
        np.array([[getattr(reading, name) for name in names] for reading in readings])
        for names in (("size", "low", "high"), ("position", "position_low", "position_high"))
    )
    draw_force_track(times, sizes * depth, places, depth=depth).save(folder / "force.png")


def force_table(forces: Sequence[FrameForce], depth: float, live: LiveRate | None = None) -> Table:
    """The largest and the last force, for the terminal.

    Args:
        forces: At least one.
        depth: Of the finger, mm.
        live: The pace, if they were found live.
    """
    known = [force for force in forces if np.isfinite(force.reading.size)]
    rows = []
    if known:
        largest = max(known, key=lambda force: force.reading.size)
        rows = [_row("largest", largest, depth), _row("last", known[-1], depth)]
    seconds = np.array([force.reading.seconds for force in forces])
    delays = np.array([force.delay for force in forces])
    unexplained = sum(force.reading.inflation > 1 for force in known)
    parts = [
        "in brackets: intervals of 95 %, for Young's modulus as given and the walls as drawn within their "
        f"tolerances; {len(known)} of {len(forces)} frames have a force, in {unexplained} of them the "
        "markers are farther off than noise explains",
        f"{1000 * seconds.mean():.0f} ms a frame, at most {1000 * seconds.max():.0f} ms",
    ]
    if live:
        parts.append(
            f"live: {live.rate:.3g} a second, {live.passed_over} frames passed over; delay "
            f"{1000 * delays.mean():.0f} ms, at most {1000 * delays.max():.0f} ms"
        )
    headings = ("", "time, s", "force, N", "N/mm", "contact, x in mm")
    return terminal_table(
        f"Force of the indenter on a finger {depth:g} mm deep", headings, rows, caption="; ".join(parts)
    )


def _row(name: str, force: FrameForce, depth: float) -> list[str]:
    reading = force.reading
    return [
        name,
        f"{force.time:.2f}",
        f"{reading.size * depth:.2f} ({reading.low * depth:.2f} to {reading.high * depth:.2f})",
        f"{reading.size:.4f}",
        f"{reading.position:.1f} ({reading.position_low:.1f} to {reading.position_high:.1f})",
    ]

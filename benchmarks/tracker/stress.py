"""The tracker under one or several disturbances: errors; markers missed, swapped, invented.

The default finger is filmed by the virtual rig at rest, while it is pressed, and held; two films for every
case, whose noise and tilt differ. The camera is known exactly. Both methods see the same films. Half an hour
on two cores; writes every finished row to `docs/evidence/tracker_stress.md`, with its date. `--rows
blur,codec` runs only the rows whose names hold one of these words: the others stay.
"""

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import partial
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.table import Table

from benchmarks.tables import DOCS, cells_of, fill, markdown
from benchmarks.tracker.cables import cable, covered
from benchmarks.tracker.films import HIDDEN, Finger, Score, figures, film_of, one_thread
from pinnray.geometry.finger.design import Design
from pinnray.runtime.errors import UserError
from pinnray.runtime.tables import terminal_table
from pinnray.vision.calibration.camera import Pose
from pinnray.vision.discs.colour import DARK
from pinnray.vision.discs.colour_picker import pick_colour
from pinnray.vision.discs.disc_detector import METHODS, DetectionMethod
from pinnray.vision.frames.frame import Frames, Image
from pinnray.vision.frames.sources import open_frames
from pinnray.vision.rig.bench import BENCH, Bench
from pinnray.vision.rig.exposure import Exposure
from pinnray.vision.rig.motion import Motion
from pinnray.vision.rig.recording import FrameTruth, Recording
from pinnray.vision.rig.recording_files import FILES, record
from pinnray.vision.rig.shapes import Shape, rectangle
from pinnray.vision.rig.virtual_camera import default_camera, viewing_pose
from pinnray.vision.tracking.scene import FilmedScene
from pinnray.vision.tracking.tracker import track
from pinnray.vision.tracking.workspace import default_workspace

REPORT = DOCS / "evidence" / "tracker_stress.md"
FILMS = 2
MOTION = Motion(rest=5, moving=3, held=5)
JUMP = Motion(rest=5, moving=0, held=5)

Hide = Callable[[Recording], Callable[[int], Sequence[Shape]]]


def fiducials(*numbers: int) -> Hide:
    """The bench's own colour over fiducials."""

    def hide(film: Recording) -> Callable[[int], Sequence[Shape]]:
        points = film.bench.workspace.points[list(numbers)]
        patches = [Shape(rectangle(point - 3.0, point + 3.0), BENCH) for point in points]
        return lambda frame: patches

    return hide


def crossing(film: Recording) -> Callable[[int], Sequence[Shape]]:
    """A cable that is drawn over the finger from base to tip, and so over one marker after the other."""
    length = film.bench.finger.section.bounds[1, 0]
    return lambda frame: [cable((length * (frame + 0.5) / len(film.motion), 0.0), 1.0, 0.5)]


@dataclass(frozen=True, kw_only=True)
class Case:
    """A film and its tracking; the defaults are the base case."""

    exposure: Mapping[str, Any] = field(default_factory=dict)
    size: tuple[int, int] = (1280, 720)
    tilt: float = 2.0
    turn: float = 0.0
    motion: Motion = MOTION
    hide: Hide = lambda film: lambda frame: ()
    codec: str = ""
    paint: str = "dark"
    irregular: float = 0.0
    picked: bool = False
    layout: str = "front"
    fiducials: bool = True
    bumped: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class Bumped(Recording):
    """A film whose camera is in another place once the finger is no longer at rest."""

    after: Recording  # From the other place

    def frames(self) -> Iterator[tuple[Image, FrameTruth]]:
        """The frames in order, each with its truth."""
        return (self.frame(number) for number in range(len(self.motion)))

    def frame(self, number: int) -> tuple[Image, FrameTruth]:
        """One frame."""
        return super().frame(number) if number < self.motion.rest else self.after.frame(number)


HALF = covered({3: 0.5, 7: 0.5})
CORNER = Case(exposure={"noise": 6, "blur": 1.5, "gradient": 0.3}, tilt=5)
CASES: dict[tuple[str, str], Case] = {
    ("base", ""): Case(),
    **{("noise", f"{noise}"): Case(exposure={"noise": noise}) for noise in (1, 3, 6, 10)},
    **{("blur, px", f"{blur}"): Case(exposure={"blur": blur}) for blur in (0.6, 1.0, 1.5, 2.5)},
    **{("shading, %", f"{share}"): Case(exposure={"gradient": share / 100}) for share in (0, 30, 60)},
    ("hidden", "a marker"): Case(hide=covered({5: 1.0})),
    ("hidden", "3 markers"): Case(hide=covered({2: 1.0, 5: 1.0, 8: 1.0})),
    ("hidden", "half of 2 markers"): Case(hide=HALF),
    ("hidden", "half of 2 markers, light cable"): Case(hide=covered({3: 0.5, 7: 0.5}, "light")),
    ("hidden", "a third of 2 markers"): Case(hide=covered({3: 0.33, 7: 0.33})),
    ("hidden", "a fiducial"): Case(hide=fiducials(2)),
    ("hidden", "2 fiducials"): Case(hide=fiducials(0, 6)),
    ("hidden", "by a cable that passes"): Case(hide=crossing, motion=Motion(rest=6, moving=6, held=6)),
    **{("codec", codec): Case(codec=codec) for codec in FILES},
    **{("size", f"{w}x{h}"): Case(size=(w, h)) for w, h in ((640, 360), (1920, 1080))},
    **{("tilt, degrees", f"{tilt}"): Case(tilt=tilt) for tilt in (0, 5, 15)},
    ("motion", "a jump of 10 mm"): Case(motion=JUMP),
    ("markers", "red, called dark"): Case(paint="red"),
    **{("markers", f"{paint}, picked"): Case(paint=paint, picked=True) for paint in ("red", "blue")},
    ("markers", "at the joints"): Case(layout="joints"),
    **{("print, irregular", f"{x:.0%}"): Case(irregular=x) for x in (0.03, 0.05, 0.08)},
    ("print", "irregular 5 %, sharpened by 1.5"): Case(irregular=0.05, exposure={"sharpen": 1.5}),
    ("print", "irregular 5 %, glare of 60"): Case(irregular=0.05, exposure={"glare": 60}),
    ("print", "irregular 5 %, white clipped"): Case(irregular=0.05, exposure={"white": 400}),
    ("camera", "monochrome"): Case(exposure={"monochrome": True}),
    ("camera", "upside down"): Case(turn=180),
    ("camera", "bumped"): Case(bumped=True),
    ("camera", "bumped, mp4v"): Case(bumped=True, codec="mp4v"),
    ("no fiducials", ""): Case(hide=fiducials(*range(7)), fiducials=False, tilt=0),
    ("corner", "noise 6, blur 1.5, shading 30 %, tilt 5"): CORNER,
    ("corner", "the same, mjpg, jump, 2 half hidden"): replace(CORNER, codec="mjpg", motion=JUMP, hide=HALF),
    ("corner", "noise 10, blur 2.5, shading 60 %, tilt 15"): Case(
        exposure={"noise": 10, "blur": 2.5, "gradient": 0.6}, tilt=15
    ),
    ("corner", "640x360, noise 6, mp4v, jump"): Case(
        exposure={"noise": 6}, size=(640, 360), codec="mp4v", motion=JUMP
    ),
}
"""Cases by the varied quantity and its value."""

HEADER = (
    *("varied", "to", "error, mm", "worst marker", "hidden", "missed", "swapped", "invented"),
    *("std, mm", "below 1 std, %", "1.96 std", "Hough: error, mm", "missed", "swapped", "invented", "of"),
)


class Outcome(NamedTuple):
    """Scores of the methods, or messages of refusal, and the number of markers hidden at rest or held."""

    scores: Mapping[DetectionMethod, Score | str]
    hidden: int
    count: int


def main(rows: str = "") -> Table:
    """Film and track all rows, or those whose names hold one of some words, and write the report."""
    words = [word.strip() for word in rows.split(",") if word.strip()] or [""]
    chosen = [name for name in CASES if any(word in " ".join(name) for word in words)]
    if not chosen:
        raise UserError(f"no row holds {rows!r}; there are {', '.join(' '.join(name) for name in CASES)}")
    lines = reported()
    fingers = {layout: Finger.pressed(Design(marker_layout=layout)) for layout in ("front", "joints")}
    with ProcessPoolExecutor(2, mp_context=get_context("spawn"), initializer=one_thread) as pool:
        outcomes = pool.map(partial(_outcome, fingers), product(chosen, range(FILMS)))
        for name in chosen:
            row = _row([next(outcomes) for _ in range(FILMS)])
            lines[name] = [*name, *row, f"{datetime.now(UTC):%Y-%m-%d}"]
            fill(
                REPORT, "figures", markdown(HEADER, [lines[case] for case in CASES if case in lines], left=2)
            )
    return terminal_table(
        "The tracker under stress", HEADER, [lines[name] for name in chosen], left=HEADER[:2]
    )


def reported() -> dict[tuple[str, str], list[str]]:
    """Rows of the page by the names of their cases."""
    rows = cells_of(REPORT, "figures")
    return {(row[0], row[1]): row for row in rows if (row[0], row[1]) in CASES}


def filmed(case: Case, finger: Finger, number: int) -> Recording:
    """One of the films of a case."""
    workspace = default_workspace(finger.design)
    camera = default_camera(*case.size)
    direction = 60.0 + 137.5 * number
    recording = Recording(
        bench=Bench(finger.mesh, finger.design, workspace, case.paint, case.irregular),
        displacement=finger.displacement,
        camera=camera,
        pose=viewing_pose(camera, workspace, tilt=case.tilt, direction=direction, turn=case.turn + number),
        exposure=Exposure(**{"noise": 2.0} | dict(case.exposure)),
        motion=case.motion,
        seed=number,
    )
    recording = replace(recording, occluders=case.hide(recording))
    if not case.bumped:
        return recording
    turn, shift = np.radians((0.1, -0.1, 0.2)), (0.5, -0.3, 0.4)  # mm
    pose = Pose(recording.pose.rotation + turn, recording.pose.translation + shift)
    return Bumped(**vars(recording), after=replace(recording, pose=pose))


def seen(case: Case, recording: Recording, methods: Sequence[DetectionMethod] = METHODS) -> Outcome:
    """Scores of methods on a film, or the line of a method that refuses it."""
    scores: dict[DetectionMethod, Score | str] = {}
    with _film(case, recording) as (frames, truths):
        with frames() as film:
            first = next(iter(film)).image
        for method in methods:
            scene = FilmedScene(
                design=recording.bench.finger,
                workspace=recording.bench.workspace,
                camera=recording.camera if case.fiducials else None,
                colour=pick_colour(first, truths[0].pixels[0].tolist()) if case.picked else DARK,
                method=method,
                markers_only=not case.fiducials,
            )
            try:
                with frames() as film:
                    scores[method] = Score.of(track(film, scene), truths)
            except UserError as error:
                scores[method] = str(error)
    least = np.minimum(truths[0].seen, truths[-1].seen)
    return Outcome(scores, int((least < HIDDEN).sum()), len(least))


@contextmanager
def _film(case: Case, recording: Recording) -> Iterator[tuple[Callable[[], Frames], Sequence[FrameTruth]]]:
    """A function that opens the film, and its truth."""
    if not case.codec:
        pictures, truths = zip(*recording.frames(), strict=True)
        yield partial(film_of, pictures), truths
        return
    with tempfile.TemporaryDirectory() as folder:
        record(recording, Path(folder), source="the virtual rig", codec=case.codec)
        truths = [recording.frame(number)[1] for number in range(len(recording.motion))]
        yield partial(open_frames, Path(folder) / FILES[case.codec]), truths


def _outcome(fingers: Mapping[str, Finger], job: tuple[tuple[str, str], int]) -> Outcome:
    name, number = job
    case = CASES[name]
    return seen(case, filmed(case, fingers[case.layout], number))


def _row(outcomes: Sequence[Outcome]) -> list[str]:
    precise, hough = (_summary(outcomes, method) for method in METHODS)
    hidden = sum(outcome.hidden for outcome in outcomes)
    return [*precise[:2], str(hidden), *precise[2:], hough[0], *hough[2:5]]


def _summary(outcomes: Sequence[Outcome], method: DetectionMethod) -> list[str]:
    """Error, worst, missed, swapped, invented, deviation, coverage; in a refused film all are missed."""
    scores = [outcome.scores[method] for outcome in outcomes]
    known = [score for score in scores if isinstance(score, Score)]
    refused = sum(outcome.count for outcome in outcomes if isinstance(outcome.scores[method], str))
    if not known:
        return ["refused", "", str(refused), *5 * [""]]
    error, worst, *others = figures(known)
    missed = refused + sum(int((~score.seen).sum()) for score in known)
    swapped, invented = (sum(getattr(score, name) for score in known) for name in ("swapped", "invented"))
    return [error, worst, str(missed), str(swapped), str(invented), *others]

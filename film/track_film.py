"""Tracks a film and writes the displacements, the trajectories and pictures to check them by eye."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from pinnray.comparison.figures import Picture
from pinnray.film.film import Film
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.observations import Observations
from pinnray.runtime.atomic import write_json
from pinnray.runtime.errors import UserError
from pinnray.runtime.tables import NONE, Cell, significant, terminal_table, write_csv
from pinnray.solvers.solver import Progress
from pinnray.vision.frames.frame import DEFAULT_RATE, RIG_MARK, Frame
from pinnray.vision.frames.pictures import write_picture
from pinnray.vision.frames.sources import open_frames
from pinnray.vision.frames.video import video_writer
from pinnray.vision.measurements import write_measurements
from pinnray.vision.tracking.annotation import annotated
from pinnray.vision.tracking.frame_tracker import FrameDetections
from pinnray.vision.tracking.tracker import track
from pinnray.vision.tracking.trajectories import Tracking

FARTHEST = 0.995
"""Motion of the markers, over the largest, of frames that show the finger as good as farthest."""
BEFORE_AND_AFTER = 2
"""Number of pictures whose times nobody asks for."""
UNTIMED = (
    f"times are counted at an assumed {DEFAULT_RATE:g} frames a second, which pictures and pipes do not say: "
    "give the fps"
)


def track_film(
    film: Film,
    design: Finger,
    folder: Path,
    report: Progress,
    *,
    video: bool = True,
    watch: Callable[[Frame, FrameDetections], str | None] | None = None,
) -> tuple[Tracking, Observations, Frame]:
    """Track a film and write `observations.csv`, `tracks.csv`, `track.json` and pictures into a folder.

    Returns, besides, the last frame that shows the finger farthest from its place in the first one.

    Args:
        film: The film.
        design: The finger in it.
        folder: An existing folder.
        report: Called with the fraction done and a short text.
        video: Whether to write the annotated video too.
        watch: Called with every frame and its detections; the words that it returns are reported.

    Raises:
        UserError: If the film cannot be read or tracked.
    """
    scene = film.scene(design)
    kept: dict[str, tuple[Frame, FrameDetections]] = {}
    farthest = 0.0
    with open_frames(film.source, rate=film.fps) as frames, ExitStack() as stack:
        if film.fps and frames.count is not None and frames.rate != film.fps:
            raise UserError(
                f"fps {film.fps:g}: {frames.name} says {frames.rate:g} frames a second itself; leave it out"
            )
        comment, write = RIG_MARK if frames.simulated else "", None
        if video:
            file = folder / "annotated.mp4"
            write = stack.enter_context(video_writer(file, frames.size, frames.rate, comment=comment))

        def see(frame: Frame, detections: FrameDetections) -> None:
            nonlocal farthest
            first = kept.setdefault("initial", (frame, detections))[1]
            away = float(np.linalg.norm(detections.places - first.places))
            if away >= FARTHEST * farthest:
                kept["final"] = (frame, detections)
            farthest = max(farthest, away)
            seen = int(np.isfinite(detections.markers.radii).sum())
            status = f"{seen} of {len(detections.places)} markers"
            if write is not None:
                lines = [f"frame {frame.number}, {frame.time:.3f} s", status]
                write(annotated(frame.image, detections, lines))
            said = watch(frame, detections) if watch is not None else None
            share = (frame.number + 1) / frames.count if frames.count else 0.0
            report(min(share, 1.0), f"frame {frame.number + 1}, {said or status}")

        tracking = track(frames, scene, see)
        if not frames.timed and len(tracking.times) > BEFORE_AND_AFTER:
            tracking = replace(tracking, warnings=(*tracking.warnings, UNTIMED))
    observations = tracking.observations(_sentence(film, tracking))
    for name, end in (("initial", tracking.rest.initial), ("final", tracking.rest.final)):
        frame, detections = kept[name]
        trajectories = list(tracking.pixels.swapaxes(0, 1)) if name == "final" else []
        lines = [f"{name}: frames {end.start} to {end.stop - 1} are at rest", *tracking.warnings]
        picture = annotated(frame.image, detections, lines, trajectories=trajectories)
        write_picture(folder / f"{name}.png", picture)
    write_measurements(folder / "observations.csv", observations)
    write_csv(folder / "tracks.csv", track_rows(tracking))
    write_json(folder / "track.json", track_summary(tracking, observations) | film.provenance())
    return tracking, observations, kept["final"][0]


def _sentence(film: Film, tracking: Tracking) -> str:
    """One sentence on the source and the accuracy of the displacements."""
    initial, final = (len(end) for end in tracking.rest)
    deviations = np.sqrt(np.diag(tracking.displacement_covariance)) if tracking.visible.any() else np.zeros(1)
    aligned = f"; {tracking.alignment}" if tracking.alignment else ""
    camera = "a calibrated camera" if film.camera else "no calibrated camera"
    origin = f"{RIG_MARK}, tracked" if tracking.simulated else "measured"
    return (
        f"{origin} by pinnray track ({film.method}, {camera}) in {Path(film.source).name}, "
        f"means of {initial} and {final} frames at rest, standard deviations {deviations.min():.2g} to "
        f"{deviations.max():.2g} mm{aligned}"
    )


def track_rows(tracking: Tracking) -> list[dict[str, Cell]]:
    """A row for every marker in every frame; empty cells where it was not detected."""
    names = ("x_px", "y_px", "std_x_px", "std_y_px", "x_mm", "y_mm")
    deviations = np.sqrt(np.diagonal(tracking.covariances, axis1=2, axis2=3))
    values = np.concatenate([tracking.pixels, deviations, tracking.positions], axis=2).tolist()
    detected = np.isfinite(tracking.pixels).all(axis=2)
    return [
        {"frame": frame, "time_s": time, "marker": marker + 1, "visible": int(seen)}
        | {name: value if seen else "" for name, value in zip(names, row, strict=True)}
        for frame, time in enumerate(tracking.times.tolist())
        for marker, (seen, row) in enumerate(zip(detected[frame], values[frame], strict=True))
    ]


def track_summary(tracking: Tracking, observations: Observations) -> dict[str, Any]:
    """The content of `track.json`, but for the film."""
    initial, final = tracking.rest
    return {
        "schema": 1,
        "simulated": tracking.simulated,
        "frames": len(tracking.times),
        "rest": {"initial": [initial.start, initial.stop - 1], "final": [final.start, final.stop - 1]},
        "fiducials_rms_mm": tracking.plane.residual,
        "markers": len(tracking.visible),
        "visible": int(tracking.visible.sum()),
        "offset_rms_mm": float(np.sqrt(np.nanmean((tracking.offsets**2).sum(axis=1)))),
        "alignment": tracking.alignment and tracking.alignment.numbers(),
        "displacement_covariance_mm2": tracking.displacement_covariance.tolist(),
        "warnings": list(tracking.warnings),
        "description": observations.source,
    }


def track_table(tracking: Tracking, observations: Observations) -> Table:
    """The displacements, for the terminal."""
    frames = np.isfinite(tracking.pixels[:, :, 0]).sum(axis=0)
    rows = []
    for number, (x, y) in enumerate(observations.points):
        cells = [NONE, NONE]
        if observations.visible[number]:
            moved, deviations = observations.displacements[number], observations.standard_deviations[number]
            pairs = zip(moved, deviations, strict=True)
            cells = [f"{value:.4f} ±{significant(deviation, 2)}" for value, deviation in pairs]
        rows.append([str(number + 1), f"{x:.3f}", f"{y:.3f}", *cells, str(frames[number])])
    return terminal_table(
        f"Displacements of the markers, mm ({observations.label})",
        ("marker", "x", "y", "u", "v", "frames"),
        rows,
        caption="±: one standard deviation; frames: in which the marker was seen",
    )


def track_figures(folder: Path, tracking: Tracking) -> list[Picture]:
    """The annotated pictures of a track, for a report."""
    measured = "tracked in a simulated film" if tracking.simulated else "measured"
    seen, count = int(tracking.visible.sum()), len(tracking.visible)
    camera = "virtual camera" if tracking.simulated else "camera"
    remarks = " ".join(f"{warning[:1].upper()}{warning[1:]}." for warning in tracking.warnings)
    return [
        Picture(
            folder / "initial.png",
            f"The finger at rest, as the {camera} saw it",
            "Green: the markers with their numbers; blue: the fiducials that give the plane.",
        ),
        Picture(
            folder / "final.png",
            f"The finger pressed, as the {camera} saw it",
            f"Magenta: the marker trajectories. {seen} of {count} markers are {measured}. {remarks}".strip(),
        ),
    ]

"""The force of the indenter in the frames of a film, from its markers: `force.csv`, its picture and table."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.table import Table

from pinnray.comparison.figures.force_charts import draw_force_track
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.tables import Cell, terminal_table, write_csv
from pinnray.solvers.identification.model import ResponseModel
from pinnray.solvers.identification.tracker import ForceReading, ForceTracker
from pinnray.solvers.identification.unknowns import DEFAULT, Unknowns
from pinnray.solvers.problem import Material, Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solver import Progress, check_law
from pinnray.vision.tracking.trajectories import Tracking

MESH = MeshSettings(size=1.0, corner_size=0.2)
"""Elements: the default finger is a thousandth stiffer with them than with those of 0.25 mm."""


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


def force_tracker(mesh: TriangleMesh, finger: Finger, material: Material, points: FloatArray) -> ForceTracker:
    """The force tracker of a finger, by quadratic elements.

    Args:
        mesh: Of the finger.
        finger: The finger.
        material: Of a law of finite strain; of the neo-Hookean one if none was given.
        points: Markers at rest, shape (m, 2), mm.

    Raises:
        UserError: If DOLFINx is missing.
    """
    check_law([make_solver("fem-id")], material)  # or says which library is missing
    from pinnray.solvers.fem.identification import FemBody

    law = "neo-hookean" if material.law == "linear" else material.law
    problem = Problem(mesh, material.model_copy(update={"law": law}), finger=finger)
    unknowns = Unknowns(problem, DEFAULT)
    return ForceTracker(ResponseModel(FemBody(unknowns, 2), unknowns), points, finger.marker_radius)


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


def force_line(force: FrameForce, depth: float) -> str:
    """A force in words: N and place with their intervals, and the delay."""
    reading = force.reading
    if not np.isfinite(reading.size):
        return f"no force: {reading.status}"
    return (
        f"force {reading.size * depth:.2f} N ({reading.low * depth:.2f} to {reading.high * depth:.2f}) at "
        f"x = {reading.position:.1f} mm ({reading.position_low:.1f} to {reading.position_high:.1f}), "
        f"{1000 * force.delay:.0f} ms after {force.time:.2f} s"
    )


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


def force_table(forces: Sequence[FrameForce], depth: float, passed_over: int | None = None) -> Table:
    """The largest and the last force, for the terminal.

    Args:
        forces: At least one.
        depth: Of the finger, mm.
        passed_over: Number of frames without a force, as an earlier one was sought; None if not live.
    """
    known = [force for force in forces if np.isfinite(force.reading.size)]
    rows = []
    if known:
        largest = max(known, key=lambda force: force.reading.size)
        rows = [_row("largest", largest, depth), _row("last", known[-1], depth)]
    delays = 1000 * np.array([force.delay for force in forces])
    unexplained = sum(force.reading.inflation > 1 for force in known)
    caption = (
        "in brackets: intervals of 95 %, for Young's modulus as given and the walls as drawn within their "
        f"tolerances; {len(known)} of {len(forces)} frames have a force, in {unexplained} of them the "
        f"markers are farther off than noise explains; {delays.mean():.0f} ms after a frame, at most "
        f"{delays.max():.0f} ms"
    )
    if passed_over is not None:
        caption += f"; {passed_over} frames were passed over"
    headings = ("", "time, s", "force, N", "N/mm", "contact, x in mm")
    title = f"Force of the indenter on a finger {depth:g} mm deep"
    return terminal_table(title, headings, rows, caption=caption)


def _row(name: str, force: FrameForce, depth: float) -> list[str]:
    reading = force.reading
    return [
        name,
        f"{force.time:.2f}",
        f"{reading.size * depth:.2f} ({reading.low * depth:.2f} to {reading.high * depth:.2f})",
        f"{reading.size:.4f}",
        f"{reading.position:.1f} ({reading.position_low:.1f} to {reading.position_high:.1f})",
    ]

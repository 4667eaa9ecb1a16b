"""The force of the indenter in the frames of a film, from its markers: `force.csv`, its picture and table."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.table import Table

from pinnray.comparison.figures.force_charts import draw_force_track
from pinnray.film.loading_path import FIRST, Loading, LoadingPath
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.finger.learned import Learned
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.tables import Cell, terminal_table, write_csv
from pinnray.solvers.identification.fit import split_phrase
from pinnray.solvers.identification.model import ResponseModel
from pinnray.solvers.identification.tracker import ForceReading, ForceTracker
from pinnray.solvers.identification.unknowns import DEFAULT, Unknowns
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solution import Estimated
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
        loading: Travel of the markers, and the branch of the frame.
    """

    frame: int
    time: float
    reading: ForceReading
    delay: float
    loading: Loading


def force_tracker(
    mesh: TriangleMesh,
    finger: Finger,
    material: Material,
    points: FloatArray,
    *,
    plane: bool,
    learned: Learned | None = None,
) -> ForceTracker:
    """The force tracker of a finger, by quadratic elements.

    In plane strain a finger with side faces is too stiff: its forces are scaled by the ratio of the two
    stiffnesses at the drawn contact. From markers of a finger of tetrahedra, pressed by 2 and 5 mm, their
    error fell from 4 % to 0 in the mean.

    Args:
        mesh: Of the finger.
        finger: The finger.
        material: Of a law of finite strain; of the neo-Hookean one if none was given.
        points: Markers at rest, shape (m, 2), mm.
        plane: Whether the finger was simulated in plane strain.
        learned: What pictures have taught of the finger.

    Raises:
        UserError: If DOLFINx is missing.
    """
    check_law([make_solver("fem-id")], material)  # or says which library is missing
    from pinnray.solvers.fem.identification import FemBody, has_depth
    from pinnray.solvers.fem.thick_body import ThickBody

    law = "neo-hookean" if material.law == "linear" else material.law
    still = Observations(points, np.zeros_like(points), visible=np.zeros(len(points)), simulated=plane)
    problem = Problem(mesh, material.model_copy(update={"law": law}), Load(), still, finger, learned)
    unknowns, thick = Unknowns(problem, DEFAULT), not plane and has_depth(finger)
    model, stiffness = ResponseModel(FemBody(unknowns, 2), unknowns, weighed=thick), 1.0
    if thick:
        stiffness = model.flexibility() / ResponseModel(ThickBody(unknowns, 2), unknowns).flexibility()
    return ForceTracker(model, points, finger.marker_radius, stiffness)


def forces_of(tracking: Tracking, tracker: ForceTracker, loss: float, progress: Progress) -> list[FrameForce]:
    """The force in every frame of a track, against the mean of its frames at rest.

    Args:
        tracking: Of the film.
        tracker: With the markers of the track.
        loss: Of the material.
        progress: Told of the frames.
    """
    rest, places = tracking.rest_positions[0], tracking.positions
    found, path = [], LoadingPath(loss)
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
        moved = np.where(seen[:, None], at - rest, 0.0)
        loading = path.follow(when, moved, deviations, seen)
        reading = path.widened(tracker.update(moved, deviations, seen), loading)
        found.append(FrameForce(number, when, reading, reading.seconds, loading))
        progress((number + 1) / len(places), f"frame {number + 1}, {reading.force.value:.3g} N/mm")
    return found


def force_line(force: FrameForce, depth: float) -> str:
    """A force in words: N and place with their intervals, and the delay."""
    reading = force.reading
    if not np.isfinite(reading.force.value):
        return f"no force: {reading.status}"
    newtons, (place, start, end) = _newtons(reading.force, depth), reading.position
    return (
        f"force {newtons[0]:.2f} N ({newtons[1]:.2f} to {newtons[2]:.2f}) at "
        f"x = {place:.1f} mm ({start:.1f} to {end:.1f}), "
        f"{1000 * force.delay:.0f} ms after {force.time:.2f} s"
    )


def force_row(force: FrameForce, depth: float) -> dict[str, Cell | None]:
    """The force in a frame by the columns of `force.csv`; None where there is no estimate or no bound."""
    reading = force.reading
    numbers = {
        f"{name}{end}_{unit}": value
        for name, unit, values in (
            ("force", "N", _newtons(reading.force, depth)),
            ("tangential_force", "N", _newtons(reading.tangential_force, depth)),
            ("position", "mm", reading.position),
        )
        for end, value in zip(("", "_low", "_high"), values, strict=True)
    }
    numbers["inflation"] = reading.inflation
    numbers["travel_mm"] = force.loading.travel
    row: dict[str, Cell | None] = {"frame": force.frame, "time_s": force.time}
    row |= {name: float(value) if np.isfinite(value) else None for name, value in numbers.items()}
    row |= {"equilibria": reading.evaluations, "seconds": reading.seconds, "delay_s": force.delay}
    return row | {"branch": force.loading.branch, "remark": reading.status}


def write_forces(folder: Path, forces: Sequence[FrameForce], depth: float) -> None:
    """Write `force.csv` and the picture `force.png` into a folder."""
    write_csv(folder / "force.csv", [force_row(force, depth) for force in forces])
    readings = [force.reading for force in forces]
    times = np.array([force.time for force in forces])
    newtons = np.array([_newtons(reading.force, depth) for reading in readings])
    places = np.array([reading.position for reading in readings])
    travel = np.array([force.loading.travel for force in forces])
    back = [comes_back(forces) and force.loading.branch not in FIRST for force in forces]
    draw_force_track(times, newtons, places, travel, np.array(back), depth=depth).save(folder / "force.png")


def comes_back(forces: Sequence[FrameForce]) -> bool:
    """Whether the finger goes back in a film."""
    return any(force.loading.branch == "unloading" for force in forces)


def loss_remark(forces: Sequence[FrameForce], loss: float) -> str | None:
    """A sentence on the intervals of the way back, or of a hold; None if a first loading is all there is."""
    if loss and any(force.loading.branch not in FIRST for force in forces):
        return f"on the way back and after a hold the interval reaches lower, by the loss of {loss:.3g}"
    if not loss and comes_back(forces):
        return (
            "the film has a way back, where the intervals hold for a material without loss only: the force "
            "of a printed or cast finger is lower; give loss, the share of the loading work that is lost"
        )
    return None


def force_table(
    forces: Sequence[FrameForce], depth: float, loss: float, passed_over: int | None = None
) -> Table:
    """The largest and the last force, for the terminal.

    Args:
        forces: At least one.
        depth: Of the finger, mm.
        loss: Of the material.
        passed_over: Number of frames without a force, as an earlier one was sought; None if not live.
    """
    known = [force for force in forces if np.isfinite(force.reading.force.value)]
    rows = []
    if known:
        largest = max(known, key=lambda force: force.reading.force.value)
        rows = [_row("largest", largest, depth), _row("last", known[-1], depth)]
    delays = 1000 * np.array([force.delay for force in forces])
    unexplained = sum(force.reading.inflation > 1 for force in known)
    caption = (
        "in brackets: intervals of 95 %, for Young's modulus as it is given, and the walls within their "
        f"tolerances; {len(known)} of {len(forces)} frames have a force, in {unexplained} of them the "
        f"markers are farther off than noise explains; {delays.mean():.0f} ms after a frame, at most "
        f"{delays.max():.0f} ms"
    )
    if known:
        caption += (
            f"; the variance of the largest force comes from: {split_phrase(largest.reading.variances)}"
        )
    if loss and (remark := loss_remark(forces, loss)):
        caption += f"; {remark}"
    if passed_over is not None:
        caption += f"; {passed_over} frames were passed over"
    headings = ("", "time, s", "force, N", "tangential force, N", "contact, x in mm")
    title = f"Force of the indenter on a finger {depth:g} mm deep"
    return terminal_table(title, headings, rows, caption=caption)


def _row(name: str, force: FrameForce, depth: float) -> list[str]:
    reading = force.reading
    newtons = (_newtons(each, depth) for each in (reading.force, reading.tangential_force))
    place, start, end = reading.position
    return [
        name,
        f"{force.time:.2f}",
        *(f"{value:.2f} ({low:.2f} to {high:.2f})" for value, low, high in newtons),
        f"{place:.1f} ({start:.1f} to {end:.1f})",
    ]


def _newtons(force: Estimated, depth: float) -> Estimated:
    """A force per depth, N/mm, for a depth, mm: in N."""
    return Estimated(*(depth * value for value in force))

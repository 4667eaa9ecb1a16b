"""Motion capture of the beam: measured markers in the beam's frame, and the model's markers."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from benchmarks.validation.half_beam import Deformation
from pinnray.runtime.arrays import FloatArray

FILE = Path(__file__).parent / "soft_beam" / "markers.csv"

LOADS = {"gravity": 0.0, "load52": 0.51012, "load101": 1.00062}
"""Load at the tip beside the beam's own weight, N."""

NAMES = ("Tip-1", "Tip-2", "Tip-3", "Base-1", "Base-2", "Base-3")
NOMINAL = np.array(
    [(0, 15, 36), (0, -6, 24), (0, 36, 6), (-94, -10, -1), (-94, 40, 27.5), (-94, 40, 0)], dtype=float
)
"""Places of the markers on the straight beam and at its clamp, in the beam's frame, shape (6, 3), mm."""

FEET = np.array([(0, 15, 30), (0, 0, 24), (0, 30, 6)], dtype=float)
"""Points of the surface that carry the tip's markers, shape (3, 3), mm."""

PATCHES = np.array(
    [[(-x, y, z) for x in (0, 5) for y, z in sides]
     for sides in ([(-3.75, 0), (0, 0), (3.75, 0)], [(0, -3), (0, 0), (0, 3)], [(0, -3), (0, 0), (0, 3)])]
)  # fmt: skip
"""Nodes of the surface around each foot, relative to it, shape (3, 6, 3), mm; the marker turns with them."""


class Run(NamedTuple):
    """One film: places of the six markers in the cameras' frame, shape (6, 3), mm.

    Attributes:
        case: Of `LOADS`.
        repeat: "a" or "b".
        held: Before the release, while the beam is held about straight by hand.
        rest: At rest under the load.
    """

    case: str
    repeat: str
    held: FloatArray
    rest: FloatArray


class Frame(NamedTuple):
    """Rigid motion from the cameras' frame to the beam's: x -> R x + t, mm."""

    rotation: FloatArray
    translation: FloatArray

    def of(self, places: FloatArray) -> FloatArray:
        """Places of shape (n, 3), mm, in the beam's frame."""
        return places @ self.rotation.T + self.translation


def read_runs(path: Path = FILE) -> list[Run]:
    """The runs of a file as `markers.csv`, in its order."""
    table = pd.read_csv(path, comment="#", index_col="marker")
    runs = []
    for (case, repeat), rows in table.groupby(["case", "repeat"], sort=False):
        named = rows.loc[list(NAMES)]
        held, rest = (named[[f"{axis}{when}_mm" for axis in "xyz"]].to_numpy() for when in (0, 1))
        runs.append(Run(str(case), str(repeat), held, rest))
    return runs


def rigid_fit(places: FloatArray, onto: FloatArray) -> Frame:
    """The rigid motion that brings places (n, 3) nearest to others (n, 3) in the mean square, mm."""
    middle, target = places.mean(axis=0), onto.mean(axis=0)
    rotation = Rotation.align_vectors(onto - target, places - middle)[0].as_matrix()
    return Frame(rotation, target - rotation @ middle)


def set_up(run: Run) -> str:
    """State of the rig, which was moved by 1 to 2 mm between `gravity` and the two loads."""
    return "gravity" if run.case == "gravity" else "loads"


def frames(runs: list[Run], *, each_run: bool = False, markers: tuple[str, ...] = NAMES) -> list[Frame]:
    """The frame of every run, from the held beam and the nominal places.

    Args:
        runs: All of them.
        each_run: Fit each run by itself, as the authors do; else all runs of a set-up together.
        markers: Names of the markers to fit.
    """
    chosen = [NAMES.index(name) for name in markers]
    found = []
    for run in runs:
        together = [run] if each_run else [other for other in runs if set_up(other) == set_up(run)]
        held = np.concatenate([other.held[chosen] for other in together])
        found.append(rigid_fit(held, np.tile(NOMINAL[chosen], (len(together), 1))))
    return found


def measured(runs: list[Run], at: list[Frame], *, from_held: bool = False) -> dict[str, FloatArray]:
    """Places of the tip's markers at rest, in the beam's frame, case by case: shape (2 repeats, 3, 3), mm.

    Args:
        runs: All of them.
        at: Their frames.
        from_held: Take the markers' places on the beam from the held beam, in the mean over a set-up, and not
            the nominal ones.
    """
    places: dict[str, list[FloatArray]] = {}
    for run, frame in zip(runs, at, strict=True):
        same = [f.of(r.held) for r, f in zip(runs, at, strict=True) if set_up(r) == set_up(run)]
        misplaced = np.mean(same, axis=0) - NOMINAL if from_held else np.zeros_like(NOMINAL)
        places.setdefault(run.case, []).append((frame.of(run.rest) - misplaced)[:3])
    return {case: np.array(both) for case, both in places.items()}


def marker_places(deformation: Deformation) -> FloatArray:
    """Places of the tip's markers on the deformed beam, shape (3, 3), mm.

    A marker stands 6 mm off the surface. It moves with its foot and turns with the surface around it.
    """
    return moved_feet(deformation) + turned_offsets(deformation)


def moved_feet(deformation: Deformation) -> FloatArray:
    """Places of the points below the markers, shape (3, 3), mm."""
    return FEET + deformation.at(FEET)


def turned_offsets(deformation: Deformation) -> FloatArray:
    """Vectors from the feet to their markers, shape (3, 3), mm, turned as the nodes of `PATCHES` turn."""
    turned = []
    for foot, offset, patch in zip(FEET, NOMINAL[:3] - FEET, PATCHES, strict=True):
        around = foot + patch
        turned.append(rigid_fit(around, around + deformation.at(around)).rotation @ offset)
    return np.array(turned)


def length(vectors: FloatArray) -> float:
    """Root mean square of the lengths of vectors of shape (n, d)."""
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))

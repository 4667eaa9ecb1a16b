"""Memory over many solves, trainings and frames: it must not grow.

`python -m benchmarks.reliability.memory [WORD]` keeps the rows of the jobs with this word in their names; all
take some fifteen minutes. Each job has a process of its own.
"""

import ctypes
import multiprocessing
import resource
import sys
from collections.abc import Callable, Iterator, Mapping
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.tables import keep_rows, kept_rows
from benchmarks.tracker.live import film
from geometry.cache import finger_mesh
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from geometry.observations import Observations
from solvers.problem import Load, Material, Problem
from solvers.registry import make_solver
from vision.tracking.frame_tracker import FrameTracker

ROWS = Path(__file__).with_name("memory.csv")

PAPER = {"preset": "paper", "epochs": 20, "width": 16, "layers": 1, "base_points": 20}
TRAINED = {
    **{"preset": "trained", "width": 6, "layers": 1},
    **{"sampled_steps": 2, "sample_points": 60, "subset_steps": 1},
}


class Row(NamedTuple):
    """Memory of the process that repeats a job, MB, and its growth over the second half, kB each time."""

    job: str
    count: int
    after_tenth: float
    after_all: float
    growth: float


def solves(name: str, material: str = "linear", **settings: Any) -> Iterator[None]:
    """Solves of a short finger with two ribs, each time another load and other markers."""
    design = Design(height=50, rib_count=2, tip_length=12, contact_position=20)
    mesh = finger_mesh(design, settings=MeshSettings(size=1.5))
    solver = make_solver(name, **settings)
    still, seen = np.full_like(mesh.markers, 0.01), np.ones(len(mesh.markers), dtype=bool)
    for number in count():
        stroke = -1.0 - 0.01 * (number % 20)
        moved = stroke / 2000 * mesh.markers**2
        given = Observations(mesh.markers, moved, still, seen, "a parabola", True, design.marker_radius)
        markers = given if getattr(solver, "assimilates", False) else None
        yield None
        solver.solve(Problem(mesh, Material(law=material), Load(displacement=(0.0, stroke)), markers, design))


def frames() -> Iterator[None]:
    """Frames of a camera that never stops."""
    scene, images = film()
    to_and_fro = [*images, *images[-2:0:-1]]
    yield None
    tracker = FrameTracker(scene, to_and_fro[0], live=True)
    for number in count(1):
        yield None
        tracker.see(to_and_fro[number % len(to_and_fro)])


IDENTIFIED = {"law": "given", "parameters": "position,normal_force"}
JOBS: Mapping[str, tuple[int, Callable[[], Iterator[None]]]] = {
    "`fem`": (200, lambda: solves("fem")),
    "`fem-nonlinear`": (200, lambda: solves("fem-nonlinear", "neo-hookean")),
    "`fem-asm`": (200, lambda: solves("fem-asm")),
    "`fem-id`": (200, lambda: solves("fem-id", "neo-hookean", **IDENTIFIED)),
    "`pinn-std`": (200, lambda: solves("pinn-std", wall_spacing=1.0, corner_spacing=0.2, neurons=4)),
    "`statfem`": (200, lambda: solves("statfem")),
    "trainings of `pinn-std --preset paper`": (50, lambda: solves("pinn-std", **PAPER)),
    "trainings of `pinn-std --preset trained`": (50, lambda: solves("pinn-std", **TRAINED)),
    "frames of `track --live`": (10_000, frames),
}
"""Number of repetitions of each job, and a generator that makes one before it yields again."""


def measured(job: str) -> Row:
    """Repeat a job in this process."""
    times, make = JOBS[job]
    repetitions = make()
    next(repetitions)  # what comes before the first one
    used = []
    for _ in range(times):
        next(repetitions)
        ctypes.CDLL("libc.so.6").malloc_trim(0)  # what is free stays resident otherwise, now more, now less
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        used.append(pages * resource.getpagesize() / 1e6)
    half = used[times // 2 :]
    slope = float(np.polyfit(np.arange(len(half)), half, 1)[0])
    return Row(job, times, used[times // 10], used[-1], 1000 * slope)


def main(word: str = "") -> None:
    """Measure the jobs with a word in their names."""
    rows = {row.job: row for row in kept_rows(ROWS, Row)}
    for job in (name for name in JOBS if word in name):
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            rows[job] = pool.apply(measured, [job])
        print(*rows[job], flush=True)
        keep_rows(ROWS, Row, [rows[name] for name in JOBS if name in rows])


if __name__ == "__main__":
    main(*sys.argv[1:])

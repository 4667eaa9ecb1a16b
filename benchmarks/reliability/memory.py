"""Memory over many solves, trainings and frames: it must not grow.

`python -m benchmarks.reliability.memory [WORD]` keeps the rows of the jobs with this word in their names; all
take some fifteen minutes. Each job has a process of its own.
"""

import csv
import ctypes
import multiprocessing
import resource
import sys
from collections.abc import Callable, Iterator, Mapping
from itertools import chain, repeat
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.tracker.live import film
from geometry.atomic import write_text
from geometry.cache import finger_mesh
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from geometry.observations import Observations
from solvers.elasticity import LawName
from solvers.problem import Load, Material, Problem
from solvers.registry import make_solver
from vision.tracking.frame_tracker import FrameTracker

ROWS = Path(__file__).with_name("memory.csv")
SOLVES, TRAININGS, FRAMES = 200, 50, 10_000

PAPER = {"preset": "paper", "epochs": 20, "width": 16, "layers": 1, "base_points": 20}
TRAINED = {
    **{"preset": "trained", "width": 6, "layers": 1},
    **{"sampled_steps": 2, "sample_points": 60, "subset_steps": 1},
}


class Row(NamedTuple):
    """Memory of the process of a job.

    Attributes:
        job: What is repeated.
        count: How often.
        after_tenth: Resident memory after a tenth of the repetitions, MB.
        after_all: After the last one, MB.
        growth: Slope of a line through the memory after each repetition of the second half, kB each.
    """

    job: str
    count: int
    after_tenth: float
    after_all: float
    growth: float


def solves(name: str, of: LawName = "linear", **settings: Any) -> Iterator[None]:
    """Solves of a short finger with two ribs, each time another load and other markers."""
    design = Design(height=50, rib_count=2, tip_length=12, contact_position=20)
    mesh = finger_mesh(design, settings=MeshSettings(size=1.5))
    solver = make_solver(name, **settings)
    still, seen = np.full_like(mesh.markers, 0.01), np.ones(len(mesh.markers), dtype=bool)
    for number in range(1_000_000):
        stroke = -1.0 - 0.01 * (number % 20)
        moved = stroke / 2000 * mesh.markers**2
        given = Observations(mesh.markers, moved, still, seen, "a parabola", True, design.marker_radius)
        load = Load(displacement=(0.0, stroke))
        markers = given if getattr(solver, "assimilates", False) else None
        yield None
        solver.solve(Problem(mesh, Material(law=of), load, markers, design))


def frames() -> Iterator[None]:
    """Frames of a camera that never stops."""
    scene, images = film()
    tracker: FrameTracker | None = None
    for image in chain.from_iterable(repeat([*images, *images[-2:0:-1]])):
        yield None
        if tracker is None:
            tracker = FrameTracker(scene, image, live=True)
        else:
            tracker.see(image)


JOBS: Mapping[str, tuple[int, Callable[[], Iterator[None]]]] = {
    "`fem`": (SOLVES, lambda: solves("fem")),
    "`fem-nonlinear`": (SOLVES, lambda: solves("fem-nonlinear", "neo-hookean")),
    "`fem-asm`": (SOLVES, lambda: solves("fem-asm")),
    "`fem-id`": (
        SOLVES,
        lambda: solves("fem-id", "neo-hookean", law="given", parameters="position,normal_force"),
    ),
    "`pinn-std`": (SOLVES, lambda: solves("pinn-std", wall_spacing=1.0, corner_spacing=0.2, neurons=4)),
    "`statfem`": (SOLVES, lambda: solves("statfem")),
    "trainings of `pinn-std --preset paper`": (TRAININGS, lambda: solves("pinn-std", **PAPER)),
    "trainings of `pinn-std --preset trained`": (TRAININGS, lambda: solves("pinn-std", **TRAINED)),
    "frames of `track --live`": (FRAMES, frames),
}
"""Number of repetitions of each job, and what makes one each time it is asked for the next."""


def measured(job: str) -> Row:
    """Repeat a job in this process."""
    count, make = JOBS[job]
    repetitions = make()
    next(repetitions)  # what comes before the first one
    used = []
    for _ in range(count):
        next(repetitions)
        ctypes.CDLL("libc.so.6").malloc_trim(0)  # what is free stays resident otherwise, now more, now less
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        used.append(pages * resource.getpagesize() / 1e6)
    half = np.array(used[count // 2 :])
    slope = float(np.polyfit(np.arange(len(half)), half, 1)[0])
    return Row(job, count, used[count // 10], used[-1], 1000 * slope)


def kept_rows() -> list[Row]:
    """The rows as they were kept."""
    if not ROWS.exists():
        return []
    with ROWS.open(encoding="utf-8", newline="") as file:
        return [Row(job, int(count), *map(float, rest)) for job, count, *rest in list(csv.reader(file))[1:]]


def main(word: str = "") -> None:
    """Measure the jobs with a word in their names."""
    for job in (name for name in JOBS if word in name):
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            row = pool.apply(measured, [job])
        print(*row, flush=True)
        rows = {each.job: each for each in (*kept_rows(), row)}
        lines = [Row._fields, *(rows[name] for name in JOBS if name in rows)]
        write_text(ROWS, "".join(",".join(map(str, line)) + "\n" for line in lines))


if __name__ == "__main__":
    main(*sys.argv[1:])

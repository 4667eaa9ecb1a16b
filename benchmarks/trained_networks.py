"""`pinn-std --preset trained`, three seeds and twelve random fingers, against elements graded to the corners.

The reference has quadratic elements graded to 0.01 mm at the corners and an eighth of the contact's width
there. A training takes about ten minutes on two quiet cores; what is in `trained_networks.csv` with the
present settings is not trained again, and `--seconds` starts no training after that time.
"""

import csv
import time
from math import inf
from pathlib import Path
from typing import NamedTuple

from rich.table import Table

from benchmarks.networks_on_designs import DESIGNS
from compare.evaluation.evaluation import Evaluation
from compare.evaluation.metrics import reference_differences
from compare.runtime.tables import write_csv
from geometry.cache import finger_mesh
from geometry.content_hash import content_hash
from geometry.finger.design import Design
from geometry.finger.finger import Finger
from geometry.mesh.settings import MeshSettings
from solvers.fem.linear import FemSolver
from solvers.pinn.trained.solver import TrainedPinnSolver
from solvers.problem import Problem
from tests.geometry.test_mesher import random_design

FIGURES = Path(__file__).with_name("trained_networks.csv")
JOBS = (*(("default", seed) for seed in range(3)), *((str(number), 0) for number in range(DESIGNS)))
"""Fingers, the default one or the number of a random one, and seeds."""


class Row(NamedTuple):
    """A training.

    Attributes:
        finger: Name.
        seed: Of the training.
        wall_s: Its time.
        cpu_s: Its time on all cores.
        displacement_percent: Relative L2 difference from the reference.
        von_mises_percent: The same for the von Mises stress.
        markers_mm: Mean of |Δu| + |Δv| at the markers.
        energy_percent: Elastic energy over the reference's, less one.
        settled: Whether the training says that it has.
        settings: Hash of the settings.
    """

    finger: str
    seed: int
    wall_s: float
    cpu_s: float
    displacement_percent: float
    von_mises_percent: float
    markers_mm: float
    energy_percent: float
    settled: str
    settings: str


def main(seconds: float = inf) -> Table:
    """Train what is missing, and show all."""
    end = time.monotonic() + seconds
    rows = {row[:2]: row for row in read()}
    for name, seed in JOBS:
        known = rows.get((name, seed))
        stale = known is None or known.settings != content_hash(TrainedPinnSolver(seed=seed).settings())
        if stale and time.monotonic() < end:
            rows[name, seed] = trained(name, seed)
            write_csv(FIGURES, [rows[job]._asdict() for job in JOBS if job in rows])
    table = Table(title="pinn-std --preset trained: relative L2 differences from graded finite elements")
    for column in Row._fields[:-1]:
        table.add_column(column, justify="left" if column in ("finger", "settled") else "right", no_wrap=True)
    for job in JOBS:
        if job in rows:
            table.add_row(*(f"{x:.3g}" if isinstance(x, float) else str(x) for x in rows[job][:-1]))
    return table


def read() -> list[Row]:
    """The rows of `FIGURES`."""
    if not FIGURES.exists():
        return []
    with FIGURES.open(encoding="utf-8") as file:
        texts = [tuple(row.values()) for row in csv.DictReader(file)]
    return [Row(name, int(seed), *map(float, rest[:6]), *rest[6:]) for name, seed, *rest in texts]


def trained(name: str, seed: int) -> Row:
    """Train on a finger, and compare."""
    finger: Finger = Design() if name == "default" else random_design(int(name))
    mesh = finger_mesh(finger)
    fine = MeshSettings(corner_size=0.01, contact_size=finger.contact_width / 8)
    reference = Evaluation.of(FemSolver().solve(Problem(finger_mesh(finger, settings=fine))), mesh)
    solver = TrainedPinnSolver(seed=seed)
    started, used = time.perf_counter(), time.process_time()
    solution = solver.solve(Problem(mesh))
    wall, cpu = time.perf_counter() - started, time.process_time() - used
    own = Evaluation.of(solution, mesh)
    differences = reference_differences(own, reference)
    return Row(
        name,
        seed,
        wall,
        cpu,
        100 * differences.displacement.rel_l2,
        100 * differences.von_mises.rel_l2,
        differences.mae_markers,
        100 * (own.energy / reference.energy - 1),
        "yes" if solution.status.converged else "no",
        content_hash(solver.settings()),
    )

"""Designs a second of a sweep with one and two workers; allow ten minutes on two idle cores.

Linear elements of degree 2 at 0.5 mm, meshing and every quantity included, from the times of a short and a
longer sweep, so that starting the workers does not count.
"""

import os
import tempfile
import time
from pathlib import Path

from rich.table import Table

from compare.runtime.tables import terminal_table
from studies.sweep.job import StudyJob
from studies.sweep.study import Study
from studies.sweep.sweep import run_sweep

VARIED = {
    "height": {"from": 80, "to": 110},
    "base_width": {"from": 24, "to": 40},
    "rib_angle": {"from": -20, "to": 30},
    "rib_count": {"from": 2, "to": 8},
    "rib_thickness": {"from": 1.0, "to": 2.5},
    "front_thickness": {"from": 1.0, "to": 2.5},
    "back_thickness": {"from": 1.0, "to": 2.5},
}
FEW, MANY = 40, 240


def main() -> Table:
    """Measure rates and their ratios."""
    core, one, two = rate(1, cores=1), rate(1), rate(2)
    figures = {
        "designs a second, one worker on one core": core,
        "designs a second, one worker on all cores": one,
        "designs a second, two workers": two,
        "ratio of two workers to one on one core": two / core,
        "ratio to one on all cores": two / one,
    }
    rows = [(name, f"{figure:.2f}") for name, figure in figures.items()]
    return terminal_table("pinnray sweep", ("what", "figure"), rows, left=["what"])


def rate(processes: int, cores: int | None = None) -> float:
    """Designs a second, without the start of the workers, on some of the cores or all of them.

    The mesher of a worker is a process of its own, so that one worker can keep more than one core busy.
    """
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, sorted(allowed)[:cores])
    try:
        return (MANY - FEW) / (_seconds(MANY, processes) - _seconds(FEW, processes))
    finally:
        os.sched_setaffinity(0, allowed)


def _seconds(count: int, processes: int) -> float:
    study = Study(name="rate", samples=count, fixed={"marker_diameter": 0.4}, varied=VARIED)
    with tempfile.TemporaryDirectory() as folder:
        started = time.perf_counter()
        run_sweep(StudyJob(study, Path(folder), Path(folder) / "out", processes))
        return time.perf_counter() - started

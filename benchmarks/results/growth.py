"""Growth of processor time and memory with the number of unknowns, for three solvers; about ten minutes.

Each size of each solver is solved in a process of its own, on one core, on the default finger. `fem` and
`fem-nonlinear` have quadratic elements of ever smaller size, `pinn-std` windows of ever smaller spacing. The
time is that of the solution alone; the memory is the largest of the process, libraries included. The rows are
kept in `docs/growth.csv`; with them come a picture, and a table on the page of large meshes.
"""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from rich.table import Table

from benchmarks.tables import DOCS, fill, keep_rows, markdown
from compare.figures.style import axes_at, solver_colour, write_heading
from compare.runtime.tables import terminal_table
from geometry import MeshSettings, load_design
from geometry.cache import finger_mesh
from geometry.errors import UserError
from geometry.figure import Figure, figure
from solvers.problem import Material, Problem
from solvers.registry import make_solver
from solvers.solver import with_law

FIGURES, PICTURE = DOCS / "growth.csv", DOCS / "pictures" / "growth.png"
PAGE = DOCS / "how-to" / "large-meshes.md"
TABLE = "growth"

ELEMENTS = (0.8, 0.4, 0.21, 0.12, 0.07)
"""Sizes of the elements, mm, with one through a wall at least: 10,000 to a million unknowns."""
SPACINGS = (1.3, 1.0, 0.8, 0.65, 0.53)
"""Spacings of the windows over those by default. At 0.42, 72,000 unknowns, they took 10.7 GB."""
LAST = 3
"""Largest sizes to which the lines are fitted: below, the libraries and the coarse elements of
`fem-nonlinear`, whose size is fixed, take most of the memory and the time."""
QUANTITIES = {"seconds": "processor time, s", "gigabytes": "memory, GB"}
SIZES = {"fem": ELEMENTS, "fem-nonlinear": ELEMENTS, "pinn-std": SPACINGS}


class Growth(NamedTuple):
    """One solution."""

    solver: str
    unknowns: int
    seconds: float  # Processor time
    gigabytes: float  # Largest memory of the process


def main() -> Table:
    """Measure every size, and write figures, picture and table.

    Raises:
        UserError: If a run fails.
    """
    rows = [_measured(solver, size) for solver, sizes in SIZES.items() for size in sizes]
    keep_rows(FIGURES, Growth, rows)
    picture(rows).save(PICTURE)
    fill(PAGE, TABLE, page_table(rows))
    cells = [(row.solver, f"{row.unknowns:,}", f"{row.seconds:.2f}", f"{row.gigabytes:.2f}") for row in rows]
    return terminal_table("Growth of cost", ("solver", "unknowns", "CPU s", "GB"), cells, left=["solver"])


def _measured(solver: str, size: float) -> Growth:
    """A solution in a process of its own, with one thread on one core."""
    core = {min(os.sched_getaffinity(0))}
    done = subprocess.run(
        [sys.executable, "-m", __name__, solver, str(size)],
        cwd=DOCS.parent,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        preexec_fn=lambda: os.sched_setaffinity(0, core),
        stdout=subprocess.PIPE,
    )
    if done.returncode:
        raise UserError(f"{solver} of size {size} failed")
    return Growth(*json.loads(done.stdout))


def solution(name: str, size: float) -> Growth:
    """Solve in this process."""
    finger, settings = load_design(), dict[str, Any]()
    if name == "pinn-std":
        usual = make_solver(name).settings()
        settings = {key: size * usual[key] for key in ("wall_spacing", "corner_spacing", "growth")}
        settings["tolerance"] = 1.0  # two levels
    solver: Any = make_solver(name, **settings)
    of_elements = {} if settings else {"settings": MeshSettings(size=size, coarsening=1.0), "across": 1}
    material = with_law(Material(), solver)
    solver.solve(Problem(finger_mesh(finger, settings=MeshSettings(size=3.0)), material))  # imports and forms
    problem = Problem(finger_mesh(finger, **of_elements), material, finger=finger)
    started = process_time()
    found = solver.solve(problem)
    seconds = process_time() - started
    status = Path("/proc/self/status").read_text(encoding="ascii")  # ru_maxrss would be the parent's, too
    most = int(status.partition("VmHWM:")[2].split()[0]) * 1024 / 1e9
    return Growth(name, int(found.stats["unknowns"]), seconds, most)


def power(rows: Sequence[Growth], quantity: str) -> tuple[float, float]:
    """Slope p and factor c of c unknowns ** p, fitted on logarithmic axes to the `LAST` sizes of a solver."""
    logs = np.log([(row.unknowns, getattr(row, quantity)) for row in rows[-LAST:]])
    slope, level = np.polyfit(*logs.T, 1)
    return float(slope), float(np.exp(level))


def page_table(rows: Sequence[Growth]) -> str:
    """The smallest and the largest size of each solver, and the slopes."""
    header = ("solver", "unknowns", "CPU s", "slope", "GB", "slope")
    cells = []
    for solver in SIZES:
        own = [row for row in rows if row.solver == solver]
        ends = [f"{row.unknowns:,}" for row in (own[0], own[-1])]
        seconds, memory = (
            [f"{getattr(row, quantity):.2g}" for row in (own[0], own[-1])] for quantity in QUANTITIES
        )
        slopes = [f"{power(own, quantity)[0]:.2f}" for quantity in QUANTITIES]
        spans = [f"{low} to {high}" for low, high in (ends, seconds, memory)]
        cells.append((f"`{solver}`", spans[0], spans[1], slopes[0], spans[2], slopes[1]))
    return markdown(header, cells)


def picture(rows: Sequence[Growth]) -> Figure:
    """Time and memory over the number of unknowns, on logarithmic axes, with fitted lines."""
    with figure(3.5) as drawn:
        write_heading(
            drawn, "Cost over the number of unknowns", "Default finger, one core; p: slope of a line"
        )
        for place, (quantity, label) in enumerate(QUANTITIES.items()):
            axes = axes_at(drawn, (0.6 + 2.75 * place, 0.5, 2.0, 1.9))
            axes.set(xscale="log", yscale="log", xlabel="unknowns", ylabel=label, ylim=(0.05, 100))
            for number, solver in enumerate(SIZES):
                _draw(axes, [row for row in rows if row.solver == solver], quantity, solver_colour(number))
            axes.grid(True)
            axes.legend(loc="upper left", bbox_to_anchor=(-0.1, -0.2), handlelength=1.0)
    return drawn


def _draw(axes: Axes, rows: Sequence[Growth], quantity: str, colour: str) -> None:
    unknowns = np.array([row.unknowns for row in rows])
    slope, factor = power(rows, quantity)
    axes.plot(unknowns, [getattr(row, quantity) for row in rows], "o", color=colour, ms=3.5, mew=0)
    label = f"{rows[0].solver}, p = {slope:.2f}"
    axes.plot(unknowns[-LAST:], factor * unknowns[-LAST:] ** slope, color=colour, lw=1.0, label=label)


if __name__ == "__main__":
    print(json.dumps(solution(sys.argv[1], float(sys.argv[2]))))

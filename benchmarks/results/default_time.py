"""Each stage of the default run in CPU seconds, beside its floor; about three minutes.

The floor of a stage is the time of the work that it cannot do without, measured in the same run: its
imports of libraries, its factorisations, the products of the networks' energy at the speed of a large one,
bare renders of the mesh, and the encoding of pictures and fields. What a stage takes beyond it is assembly,
evaluation, text and Python. The stages are timed in one process on one core; the last row is the whole
command on two. A run before them, which is not timed, fills the cache with mesh and truth.
"""

import json
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time, thread_time
from typing import Any, NamedTuple

import numpy as np
from rich.table import Table

from pinnray.runtime import stages
from pinnray.runtime.errors import UserError
from pinnray.runtime.machine import cores
from pinnray.runtime.tables import terminal_table
from pinnray.solvers.solver import Progress

ROOT = Path(__file__).parents[2]

LIBRARIES = ("scipy.sparse.linalg", "dolfinx", "torch", "pyvista", "matplotlib.figure")

PRODUCTS = "GFlop of products"
NEEDED = {
    "factorisations": (
        "pinnray.solvers.fem.factorisation:Factorisation.update",
        "pinnray.solvers.pinn.finite_basis.sparse_cholesky:BlockMatrix.factorised",
    ),
    PRODUCTS: ("pinnray.solvers.pinn.finite_basis.energy:NetworkEnergy.hessian",),
    "renders": ("pinnray.comparison.figures.canvas:Canvas._cover",),
    "fields written": ("pinnray.comparison.report.output_files:_write",),
    "pictures encoded": ("PIL.Image:Image.save",),
}
"""What no stage can do without: the functions that do it, by its name."""


class StageTime(NamedTuple):
    """A stage: CPU seconds, those that it needs, and what for."""

    name: str
    seconds: float
    floor: float
    needs: str


def main() -> Table:
    """Time the stages in a process of their own, and the whole command.

    Raises:
        UserError: On a machine with one core, or if a run fails.
    """
    if cores() < 2:
        raise UserError("the whole command is timed on 2 cores, and there is one")
    with TemporaryDirectory() as folder:
        options = ["compare", "--quiet", "--out", f"{folder}/out"]
        whole = [sys.executable, "-m", "pinnray.cli", *options]
        _run(whole, 2)
        started = perf_counter()
        _run(whole, 2)
        wall = perf_counter() - started
        answer = Path(folder) / "stages.json"
        _run([sys.executable, "-m", __name__, str(answer), *options], 1)
        rows = [StageTime(*row) for row in json.loads(answer.read_text(encoding="utf-8"))]
    shown = [(row.name, f"{row.seconds:.2f}", f"{row.floor:.2f}", row.needs) for row in rows]
    total = [f"{sum(column):.2f}" for column in ([row.seconds for row in rows], [row.floor for row in rows])]
    shown += [("all stages", *total, ""), ("whole command, 2 cores, wall", f"{wall:.2f}", "", "")]
    return terminal_table("The default run, CPU s", ("stage", "CPU s", "floor", "for"), shown, left=["stage"])


def _run(command: Sequence[str], count: int) -> None:
    """Run a command on some cores, in which the linear algebra has one thread."""
    allowed = sorted(os.sched_getaffinity(0))[:count]
    threads = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    limited = lambda: os.sched_setaffinity(0, allowed)  # noqa: E731
    if subprocess.run(command, cwd=ROOT, env=os.environ | threads, preexec_fn=limited).returncode:
        raise UserError("the default run failed; run `compare` to see why")


def stage_times(command: list[str]) -> list[StageTime]:
    """Run a command of `pinnray` in this process, and time its stages."""
    counts, seconds, rows = Counter[str](), Counter[str](), []
    side = 2000
    square = np.ones((side, side))
    started = thread_time()
    square @ square
    per_gflop = (thread_time() - started) / (2e-9 * side**3)

    class Timed(stages.Stages):
        @contextmanager
        def stage(self, name: str) -> Iterator[Progress]:
            counts.clear()
            seconds.clear()
            started = process_time()
            with super().stage(name) as report:
                yield report
            seconds[PRODUCTS] = counts[PRODUCTS] * per_gflop
            needs = ", ".join(f"{count:.3g} {kind}" for kind, count in counts.items())
            rows.append(StageTime(name, process_time() - started, sum(seconds.values()), needs))

    def counted(kind: str, work: Callable[..., Any]) -> Callable[..., Any]:
        def call(*given: Any, **options: Any) -> Any:
            started = thread_time()
            result = work(*given, **options)
            seconds[kind] += thread_time() - started
            counts[kind] += _gflop(given[0]) if kind == PRODUCTS else 1
            return result

        return call

    for library in LIBRARIES:
        import_module(library)
    floor = process_time()
    from pinnray.cli import main as pinnray

    stages.Stages = Timed
    for kind, places in NEEDED.items():
        for place in places:
            module, _, path = place.partition(":")
            *above, name = path.split(".")
            owner = getattr(import_module(module), above[0]) if above else import_module(module)
            setattr(owner, name, counted(kind, getattr(owner, name)))
    rows.append(StageTime("start-up and imports", process_time(), floor, "the libraries alone"))
    if pinnray(command):
        raise UserError("the default run failed; run `compare` to see why")
    return rows


def _gflop(energy: Any) -> float:
    """Of the products in the Hessian of a quadratic energy: one for each pair of windows at a point."""
    per_window = 2 * energy.basis.per_window
    pairs = (len(patch.points) * len(patch.near) * (len(patch.near) + 1) / 2 for patch in energy.patches)
    return 2e-9 * per_window**2 * sum(pairs)


if __name__ == "__main__":
    answer, *command = sys.argv[1:]
    Path(answer).write_text(json.dumps(stage_times(command)), encoding="utf-8")

"""Each stage of the default run in CPU seconds, beside its floor; about three minutes.

The floor of a stage is the time of the work that it cannot do without, measured in the same run: its
imports of libraries, its factorisations, the products of the networks' energy, bare renders of the mesh, and
the encoding of pictures and fields. What a stage takes beyond it is assembly, evaluation, text and Python.
All is timed in one process on one core, after a run in another one that fills the cache with mesh and truth.
"""

import os
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from multiprocessing import get_context
from pkgutil import resolve_name
from tempfile import TemporaryDirectory
from time import process_time, thread_time
from typing import Any
from unittest.mock import patch

from rich.table import Table

from pinnray.runtime.errors import UserError
from pinnray.runtime.tables import terminal_table
from pinnray.solvers.solver import Progress

LIBRARIES = ("scipy.sparse.linalg", "dolfinx", "torch", "pyvista", "matplotlib.figure")

NEEDED = {
    "factorisations": (
        "pinnray.solvers.fem.factorisation.Factorisation.update",
        "pinnray.solvers.symmetric_factors.BlockMatrix.factorised",
    ),
    "products": ("pinnray.solvers.pinn.finite_basis.energy.NetworkEnergy.hessian",),
    "renders": ("pinnray.comparison.figures.canvas.Canvas._cover",),
    "fields written": ("pinnray.comparison.report.output_files._write",),
    "pictures encoded": ("PIL.Image.Image.save",),
}
"""What no stage can do without: the functions that do it, by its name."""


def main() -> Table:
    """Run the comparison twice on one core, the second time with a clock in every stage.

    Raises:
        UserError: If a run fails.
    """
    threads = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    core = min(os.sched_getaffinity(0))
    with TemporaryDirectory() as folder, patch.dict(os.environ, threads):
        command = ["compare", "--quiet", "--out", f"{folder}/out"]
        context = get_context("spawn")
        with context.Pool(1, os.sched_setaffinity, (0, {core}), maxtasksperchild=1) as pool:
            _, rows = pool.map(stage_times, [command] * 2, chunksize=1)
    total = [sum(column) for column in list(zip(*rows, strict=True))[1:3]]
    shown = [(name, f"{seconds:.2f}", f"{floor:.2f}", needs) for name, seconds, floor, needs in rows]
    shown.append(("all stages", *(f"{seconds:.2f}" for seconds in total), ""))
    return terminal_table("The default run, CPU s", ("stage", "CPU s", "floor", "for"), shown, left=["stage"])


def stage_times(command: Sequence[str]) -> list[tuple[str, float, float, str]]:
    """Run a command of `pinnray`: by stage the CPU seconds, those that it needs, and what for."""
    counts, seconds, rows = Counter[str](), Counter[str](), []
    for library in LIBRARIES:
        import_module(library)
    floor = process_time()
    from pinnray.cli import main as pinnray
    from pinnray.runtime import stages

    class Timed(stages.Stages):
        @contextmanager
        def stage(self, name: str) -> Iterator[Progress]:
            counts.clear()
            seconds.clear()
            started = process_time()
            with super().stage(name) as report:
                yield report
            needs = ", ".join(f"{count} {kind}" for kind, count in counts.items())
            rows.append((name, process_time() - started, sum(seconds.values()), needs))

    def counted(kind: str, work: Callable[..., Any]) -> Callable[..., Any]:
        def call(*given: Any, **options: Any) -> Any:
            started = thread_time()
            result = work(*given, **options)
            seconds[kind] += thread_time() - started
            counts[kind] += 1
            return result

        return call

    stages.Stages = Timed
    for kind, places in NEEDED.items():
        for place in places:
            above, _, name = place.rpartition(".")
            owner = resolve_name(above)
            setattr(owner, name, counted(kind, getattr(owner, name)))
    rows.append(("start-up and imports", process_time(), floor, "the libraries alone"))
    if pinnray(command):
        raise UserError("the default run failed; run `compare` to see why")
    return rows

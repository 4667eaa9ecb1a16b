"""The time of the default run by its stages, on one core and on two; about four minutes.

On two cores the solvers of finite strain run in a process of their own, so that stages overlap. The first
run, which is not timed, fills the cache with mesh and truth.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.table import Table

from compare.runtime.provenance import cores
from geometry.errors import UserError

ROOT = Path(__file__).parents[1]
COUNTS = (1, 2)


def main() -> Table:
    """Time the runs.

    Raises:
        UserError: On a machine with one core, or if the run fails.
    """
    if cores() < max(COUNTS):
        raise UserError(f"the default run is compared on {max(COUNTS)} cores, and there is one")
    table = Table(title="The default run, s")
    table.add_column("stage")
    for count in COUNTS:
        table.add_column(f"{count} core{'s' * (count > 1)}", justify="right")
    with TemporaryDirectory() as folder:
        _timed(Path(folder), max(COUNTS))
        walls, stages = zip(*(_timed(Path(folder), count) for count in COUNTS), strict=True)
    for name in stages[0]:
        table.add_row(name, *(f"{each[name]:.1f}" for each in stages))
    table.add_row("whole command", *(f"{wall:.1f}" for wall in walls))
    return table


def _timed(folder: Path, count: int) -> tuple[float, dict[str, float]]:
    """The time of the command on some cores, and that of its stages, s."""
    allowed = set(sorted(os.sched_getaffinity(0))[:count])
    hold: Callable[[], None] = partial(os.sched_setaffinity, 0, allowed)
    started = time.perf_counter()
    run = [sys.executable, "-m", "compare.cli", "compare", "--quiet", "--out", str(folder / "out")]
    if subprocess.run(run, cwd=ROOT, preexec_fn=hold).returncode:
        raise UserError("the default run failed; run `compare` to see why")
    seconds = json.loads((folder / "out" / "run.json").read_text(encoding="utf-8"))["seconds"]
    return time.perf_counter() - started, seconds

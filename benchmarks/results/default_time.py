"""The time of the default run by its stages, on one core and on two; about four minutes.

On two cores the solvers of finite strain run in a process of their own, so that stages overlap. The first
run, which is not timed, fills the cache with mesh and truth.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.table import Table

from compare.runtime.provenance import cores
from compare.runtime.tables import terminal_table
from geometry.errors import UserError

ROOT = Path(__file__).parents[2]


def main() -> Table:
    """Time the runs.

    Raises:
        UserError: On a machine with one core, or if the run fails.
    """
    if cores() < 2:
        raise UserError("the default run is compared on 2 cores, and there is one")
    with TemporaryDirectory() as folder:
        _timed(Path(folder), 2)
        one, two = (_timed(Path(folder), count) for count in (1, 2))
    rows = [(stage, f"{seconds:.1f}", f"{two[stage]:.1f}") for stage, seconds in one.items()]
    return terminal_table("The default run, s", ("stage", "1 core", "2 cores"), rows, left=["stage"])


def _timed(folder: Path, count: int) -> dict[str, float]:
    """Times of the stages and of the whole command on some cores, s."""
    allowed = sorted(os.sched_getaffinity(0))[:count]
    started = time.perf_counter()
    run = [sys.executable, "-m", "pinnray.cli", "compare", "--quiet", "--out", str(folder / "out")]
    if subprocess.run(run, cwd=ROOT, preexec_fn=lambda: os.sched_setaffinity(0, allowed)).returncode:
        raise UserError("the default run failed; run `compare` to see why")
    stages = json.loads((folder / "out" / "run.json").read_text(encoding="utf-8"))["seconds"]
    return {**stages, "whole command": time.perf_counter() - started}

"""Sweeps: designs a second with one and two workers, and a sweep whose processes are killed at random.

The rate is that of linear elements of degree 2 at 0.5 mm, meshing and every quantity included, from the times
of a short and a longer sweep, so that starting the workers does not count. Then 10,000 designs at 2 mm are
run while a worker is killed every few seconds and the program itself three times: none may be lost or done
twice. Allow an hour on two idle cores, 100 minutes on busy ones.
"""

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

from rich.table import Table
from threadpoolctl import threadpool_limits

from compare.sweep.measurement import measured
from compare.sweep.study import Study, TaskMaker
from compare.sweep.sweep import STUDY_FILE, SweepJob, load_sweep, run_sweep
from geometry.errors import UserError

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
KILLED = 10_000
PAUSE_S = (4.0, 16.0)
"""Shortest and longest time between two kills."""

PROGRAM_KILLS = 3
CHECKED = 20
"""Samples of the killed sweep that are solved once more."""

COMMAND = "import sys; from compare.cli import main; sys.exit(main(sys.argv[1:]))"


def main() -> Table:
    """Measure rates and kill, and return both as one table."""
    table = Table(title="pinnray sweep")
    table.add_column("what", no_wrap=True)
    table.add_column("figure", justify="right", no_wrap=True)
    core, one, two = rate(1, cores=1), rate(1), rate(2)
    table.add_row("designs a second, one worker on one core", f"{core:.2f}")
    table.add_row("designs a second, one worker on all cores", f"{one:.2f}")
    table.add_row("designs a second, two workers", f"{two:.2f}")
    table.add_row("ratio of two workers to one on one core", f"{two / core:.2f}")
    table.add_row("ratio to one on all cores", f"{two / one:.2f}")
    for name, figure in under_kills(KILLED).items():
        table.add_row(name, figure)
    return table


def rate(processes: int, cores: int | None = None) -> float:
    """Designs a second at 0.5 mm, without the start of the workers, on some of the cores or all of them.

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
        run_sweep(SweepJob(study, Path(folder), Path(folder) / "out", processes))
        return time.perf_counter() - started


def under_kills(count: int, seed: int = 0) -> dict[str, str]:
    """Run a sweep by its command, kill its processes at random, and count what is there in the end."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file, out = folder / "killed.toml", folder / "out"
        lines = [f"mesh_size = 2.0\nsamples = {count}\n[fixed]\nmarker_diameter = 0.4\n[varied]"]
        lines += [f"{key} = {{from = {ends['from']}, to = {ends['to']}}}" for key, ends in VARIED.items()]
        file.write_text("\n".join(lines), encoding="utf-8")
        command = [sys.executable, "-c", COMMAND, "sweep", str(file), "--out", str(out)]
        started = time.perf_counter()
        kills, code = _run_and_kill(command, out, count, random.Random(seed))
        seconds = time.perf_counter() - started
        sweep = load_sweep(out)
        numbers = Counter(each.number for each in sweep.measurements)
        maker = TaskMaker(sweep.study, folder)
        again = [sweep.measurements[n] for n in random.Random(seed).sample(range(count), min(CHECKED, count))]
        with threadpool_limits(1):  # as in the workers: with two threads the last bits differ
            tasks = [maker.task(each.number, sweep.samples[each.number]) for each in again]
            same = sum(measured(task).values == each.values for task, each in zip(tasks, again, strict=True))
        states = Counter(each.state for each in sweep.measurements)
        return {
            "designs, 2 mm": f"{count:,}",
            "workers killed": str(kills["worker"]),
            "program killed": str(kills["program"]),
            "exit code of the last start": str(code),
            "lost": str(count - len(numbers)),
            "twice": str(sum(times > 1 for times in numbers.values())),
            "states": ", ".join(f"{states[state]:,} {state}" for state in sorted(states)),
            f"equal to the bit when solved again, of {len(again)}": str(same),
            "orphans after the kills of the program": str(kills["orphan"]),
            "minutes": f"{seconds / 60:.1f}",
            "file": STUDY_FILE,
        }


def _run_and_kill(command: list[str], out: Path, count: int, draw: random.Random) -> tuple[Counter[str], int]:
    """Start the command until it ends by itself; the numbers of kills, and its exit code."""
    kills: Counter[str] = Counter()
    ends = [count * (part + 1) // (PROGRAM_KILLS + 1) for part in range(PROGRAM_KILLS)]
    process = subprocess.Popen(command)
    while True:
        with suppress(subprocess.TimeoutExpired):
            return kills, process.wait(draw.uniform(*PAUSE_S))
        if ends and _finished(out) > ends[0]:
            ends.pop(0)
            workers = _children(process.pid)
            process.kill()
            process.wait()
            kills["program"] += 1
            time.sleep(10)
            kills["orphan"] += sum(Path(f"/proc/{worker}").exists() for worker in workers)
            process = subprocess.Popen(command)
        elif workers := _children(process.pid):
            with suppress(ProcessLookupError):
                os.kill(draw.choice(workers), signal.SIGKILL)
                kills["worker"] += 1


def _finished(out: Path) -> int:
    try:
        return len(load_sweep(out).measurements)
    except UserError:
        return 0


def _children(parent: int) -> list[int]:
    """Worker processes of the command."""
    listed = subprocess.run(["pgrep", "-P", str(parent), "-f", "spawn_main"], capture_output=True, text=True)
    return [int(word) for word in listed.stdout.split()]

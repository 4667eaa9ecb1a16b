"""Kills of a comparison on two threads: what `--resume` gives agrees with a run that was never interrupted.

`python -m benchmarks.reliability.two_threads` keeps the largest difference. On one thread results agree to
the bit (`faults`); two threads may add in another order.
"""

import json
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.reliability.folders import TIMES
from benchmarks.reliability.jobs import CACHE, OUT
from benchmarks.reliability.supervision import Ending, Fault, supervised
from benchmarks.reliability.trials import NOT_CONVERGED
from geometry.atomic import write_text

KEPT = Path(__file__).with_name("two_threads.json")
ROOT = Path(__file__).parents[2]
ARGUMENTS = ("--design", "default", "--mesh-size", "1", "--solvers", "fem,fem-nonlinear,pinn-std", "--quiet")
KILLS = 12
"""Kills, evenly over the points of the run."""


class Agreement(NamedTuple):
    """Number of kills, and largest relative difference after them and between two whole runs."""

    kills: int
    after_kills: float
    undisturbed: float


def main() -> None:
    """Kill and resume the comparison, and keep what was found."""
    with tempfile.TemporaryDirectory(prefix="reliability-") as name:
        folder = Path(name)
        _compared(folder)  # fills the cache
        whole, again = _values(folder, _compared(folder)), _values(folder, ending := _compared(folder))
        worst, count = 0.0, len(ending.points)
        for at in sorted({round(share) for share in np.linspace(0, count - 1, KILLS)}):
            shutil.rmtree(folder / OUT)
            hit = supervised(_command(folder), _watched(folder), folder / "log", fault=Fault("kill", at))
            resumed = _values(folder, _compared(folder, "--resume"))
            worst = max(worst, difference(whole, resumed))
            print(hit.points[at], f"{difference(whole, resumed):.1e}", flush=True)
        found = Agreement(KILLS, worst, difference(whole, again))
    write_text(KEPT, json.dumps(found._asdict(), indent=1) + "\n")
    print(found)


def kept() -> Agreement | None:
    """What was found as it was kept."""
    return Agreement(**json.loads(KEPT.read_text(encoding="utf-8"))) if KEPT.exists() else None


def difference(one: Mapping[str, Any], other: Mapping[str, Any]) -> float:
    """Largest difference of numbers by the same name, as a fraction of the largest of them.

    Raises:
        ValueError: If the names, or the numbers of numbers, differ.
    """
    if one.keys() != other.keys():
        raise ValueError(f"one run alone has {sorted(one.keys() ^ other.keys())}")
    worst = 0.0
    for name, values in one.items():
        a, b = np.asarray(values, float), np.asarray(other[name], float)
        if a.shape != b.shape or (np.isfinite(a) != np.isfinite(b)).any():
            raise ValueError(f"{name} is of another shape, or finite in one run alone")
        a, b = a[np.isfinite(a)], b[np.isfinite(b)]
        if (scale := float(np.abs(a).max(initial=0.0))) > 0:
            worst = max(worst, float(np.abs(a - b).max()) / scale)
    return worst


def _compared(folder: Path, *more: str) -> Ending:
    """A run that is not disturbed; a folder that it does not resume is removed before."""
    if not more:
        shutil.rmtree(folder / OUT, ignore_errors=True)
    ending = supervised(_command(folder, *more), _watched(folder), folder / "log")
    if ending.code not in (0, NOT_CONVERGED):
        raise RuntimeError(ending.text)
    return ending


def _command(folder: Path, *more: str) -> Any:
    """A function that becomes the command: forks of a process with threads of its own would have none."""

    def work() -> int:
        os.environ.update(OMP_NUM_THREADS="2", PINNRAY_CACHE=str(folder / CACHE), PYTHONPATH=str(ROOT))
        code = "import sys; from compare.cli import main; sys.exit(main(sys.argv[1:]))"
        os.execv(
            sys.executable,
            [sys.executable, "-c", code, "compare", *ARGUMENTS, "--out", str(folder / OUT), *more],
        )

    return work


def _watched(folder: Path) -> list[Path]:
    return [folder / OUT, folder / f".{OUT}"]


def _values(folder: Path, _: Ending) -> dict[str, Any]:
    """Numbers of a result by name, without times: of `metrics.json`, and the arrays of every solution."""
    found = dict(_numbers(json.loads((folder / OUT / "metrics.json").read_text(encoding="utf-8")), "metrics"))
    for path in sorted((folder / OUT / "solutions").glob("*.npz")):
        with np.load(path, allow_pickle=False) as arrays:
            found |= {
                f"{path.stem}/{name}": array
                for name, array in arrays.items()
                if array.dtype.kind == "f" and not any(word in name for word in TIMES)
            }
    return found


def _numbers(value: Any, name: str) -> Iterator[tuple[str, Any]]:
    """Numbers, and lists of numbers, without times."""
    if isinstance(value, Mapping):
        for key, each in value.items():
            if not any(word in key for word in TIMES):
                yield from _numbers(each, f"{name}/{key}")
    elif isinstance(value, list) and not all(isinstance(each, int | float) for each in value):
        for number, each in enumerate(value):
            yield from _numbers(each, f"{name}/{number}")
    elif isinstance(value, int | float | list) and not isinstance(value, bool):
        yield name, value


if __name__ == "__main__":
    main()

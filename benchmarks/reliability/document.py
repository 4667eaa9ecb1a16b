"""Faults at every change of a file, random and mutated input; writes `docs/reliability.md`.

Each command runs in a forked process whose changes of files are counted. Then it runs again for each,
with a fault there: killed before it, killed in the middle of a write, a disk that is full from there on, one
failed call. The same command goes on and must give the numbers of the undisturbed run to the bit. x86-64
Linux only. Trials that are kept are not run again; `--rows compare` makes those of the jobs with this word in
their names. All take some five hours of one core. The page's words are in `page.md`.
"""

import json
import os
import platform
from collections import Counter
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from string import Template

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one thread: numbers are to agree to the bit

from rich.table import Table

from benchmarks.reliability import inputs
from benchmarks.reliability.faults import Row, run_faults
from benchmarks.reliability.jobs import JOBS
from benchmarks.tables import DOCS, kept_rows, markdown
from pinnray.runtime.atomic import write_text
from pinnray.runtime.tables import terminal_table

HERE = Path(__file__).parent
PAGE = DOCS / "reliability.md"
FAULTS = ("job", "points", "killed", "torn write", "full disk", "failed call", "as promised", "left over")
INPUTS = ("solver", "inputs", "solved", "not converged", "refused", "wrong", "slowest, s", "memory, MB")


def main(rows: str = "") -> Table:
    """Run the trials of the jobs with one of the words, write the page and return its table."""
    found = run_faults(rows.split(",") if rows else ())
    write_text(PAGE, page(found))
    return terminal_table("faults", FAULTS, fault_rows(found), left=["job"])


def page(rows: Sequence[Row]) -> str:
    """The page of all results that are kept."""
    wrong = [row for row in rows if row.faults]
    said = [f"- {row.job}, {row.kind} at {row.call} {row.path}: {row.faults}\n" for row in wrong]
    tried = [
        (f"`{each.solver}`", *map(str, each[1:6]), f"{each.slowest:.1f}", f"{each.peak / 1e6:.0f}")
        for each in kept_rows(inputs.ROWS, inputs.Row)
    ]
    return Template((HERE / "page.md").read_text(encoding="utf-8")).substitute(
        machine=f"{platform.machine()}, Python {platform.python_version()}, numpy {version('numpy')}",
        faults=markdown(FAULTS, fault_rows(rows)),
        wrong=f"{len(wrong)} of {len(rows)} trials are not as promised:\n\n{''.join(said)}\n"
        if wrong
        else "",
        inputs=markdown(INPUTS, tried),
        **same_answer(),
    )


def fault_rows(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """A row of the table for each job, and the sum."""
    groups = {job.name: [row for row in rows if row.job == job.name] for job in JOBS}
    return [_counted(name, group) for name, group in {**groups, "all": rows}.items() if group]


def _counted(name: str, rows: Sequence[Row]) -> tuple[str, ...]:
    kinds = Counter(row.kind for row in rows)
    points = len({(row.job, row.at) for row in rows})
    promised, left = sum(not row.faults for row in rows), sum(bool(row.leftovers) for row in rows)
    counts = (points, *(kinds[kind] for kind in ("kill", "torn", "ENOSPC", "EIO")), promised, left)
    return name, *map(str, counts)


def same_answer() -> dict[str, str]:
    """Largest relative differences of stored numbers from those of other systems, `golden/*.json`.

    All are of the commit before 56ec7c18; the tests' own numbers have changed since, with the solvers. Such a
    file is what `python -m tests.solvers.contract.golden` prints there; in the container:
    `buildah run -v $PWD:/src:ro -e PYTHONPATH=/src --workingdir /src CONTAINER
    python -m tests.solvers.contract.golden`.
    """
    own_file = HERE / "golden" / "stored.json"
    files = (own_file, *sorted({*HERE.glob("golden/*.json")} - {own_file}))
    stored, *others = (json.loads(path.read_text(encoding="utf-8")) for path in files)

    def difference(job: str, other: dict[str, dict[str, float]]) -> str:
        return f"{max(abs(other[job][key] / value - 1) for key, value in stored['jobs'][job].items()):.1e}"

    own = [f"{name} {number}" for name, number in stored["system"].items()]
    systems = [[f"{name} {number}" for name, number in each["system"].items()] for each in others]
    header = ("job", *(", ".join(each for each in system if each not in own) for system in systems))
    rows = [(f"`{job}`", *(difference(job, each["jobs"]) for each in others)) for job in stored["jobs"]]
    return {"stored": ", ".join(own), "same": markdown(header, rows)}

"""Score solvers on a fixed set of problems."""

from pathlib import Path

from rich.console import Console

from pinnray.options.shared import OptionalOutputPath, SolverOptions, going_on_from
from pinnray.runtime.exits import NOT_CONVERGED, say

WIDE = ("no.", "solved", "v. Mises,\n%", "energy,\n%", "memory,\nGB")
"""Headings of columns for which a terminal is too narrow."""


def command(
    solvers: str = "fem,fem-nonlinear,pinn-std",
    *,
    options: SolverOptions = SolverOptions(),
    problems: str = "small",
    entries: Path | None = None,
    time_limit: float = 600.0,
    out: OptionalOutputPath = None,
) -> int:
    """Score solvers on a fixed set of problems: accuracy, cost, and whether what they claim is true.

    References are finite elements graded to the corners. Each result is kept at once: the same command again
    goes on where it was stopped. Each solver gets a file in the folder entries, which can be sent in;
    docs/benchmark.md has all entries and says how to enter.

    Args:
        solvers: Names of solvers, separated by commas.
        problems: Set of problems: small (12, a few minutes) or full (40).
        entries: Folder with entries of others to show beside them, such as docs/benchmark.
        time_limit: Longest time for a problem, s.
        out: Output folder; default out/benchmark-PROBLEMS.
    """
    from pinnray.runtime.stages import Stages
    from pinnray.runtime.tables import terminal_table
    from pinnray.studies.benchmark.benchmark import BenchmarkJob, run_benchmark
    from pinnray.studies.benchmark.page import broken_table, summary_table, write_benchmark

    job = BenchmarkJob(
        solvers=options.read(solvers),
        out=out or Path("out") / f"benchmark-{problems}",
        which=problems,
        time_limit=time_limit,
        others=entries,
    )
    with going_on_from(job.out), Stages() as stages:
        found = run_benchmark(job, stages)
        written = write_benchmark(found, job.out, stages.record())
    for table in (broken_table(found), summary_table(found)):
        kept = [place for place, heading in enumerate(table.headings) if heading not in WIDE]
        headings, *rows = [[row[place] for place in kept] for row in (table.headings, *table.rows)]
        if rows:
            Console().print(terminal_table(table.title, headings, rows, left=table.left, narrow=True))
    print(*written, sep="\n")
    for remark in found.remarks:
        say(f"warning: {remark}")
    own = [row.state for entry in found.entries[: len(job.solvers)] for row in entry.rows]
    return 0 if set(own) <= {"done", "refused"} else NOT_CONVERGED

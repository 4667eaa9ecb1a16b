"""The entries of docs/benchmark.md, run here, and the page's table and picture from all files of entries.

- `full-entries`: each entry on the full set, which holds the small one, two hours; `--rows` chooses some by
  words in their names.
- `entries`: the same on the small set alone, for what takes minutes a problem.
- `page`: only the page.
"""

from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from rich.table import Table

from benchmarks.tables import DOCS, fill, markdown
from pinnray.runtime.stages import Stages
from pinnray.runtime.tables import terminal_table
from pinnray.solvers.registry import make_solver
from pinnray.studies.benchmark.benchmark import Benchmark, BenchmarkJob, run_benchmark
from pinnray.studies.benchmark.entry import load_entries
from pinnray.studies.benchmark.page import broken_table, summary_table
from pinnray.studies.benchmark.picture import draw_accuracy
from pinnray.studies.benchmark.problems import SETS, problem_set

FOLDER, PAGE = DOCS / "benchmark", DOCS / "benchmark.md"


BEST = "Best of five settings on a finger that is not scored."
DEEP = "deep_energy:DeepEnergySolver"
PAPER = "1,500 of its 60,000 epochs, about as long as the preset trained takes."
FELUPE = "A derivative of its quadratic triangle is put right; linear problems are solved by SuperLU."

ALL: dict[str, tuple[str, dict[str, Any], str]] = {
    "fem": ("fem", {}, ""),
    "fem-nonlinear": ("fem-nonlinear", {}, ""),
    "skfem-p1": ("scikit_fem:SkfemEntry", {"degree": 1}, ""),
    "skfem-p2": ("scikit_fem:SkfemEntry", {}, "SuperLU is in its symmetric mode."),
    "felupe": ("felupe_entry:FelupeEntry", {}, FELUPE),
    "torch-fem": ("torch_fem:TorchFemEntry", {}, ""),
    "pinn-std fast": ("pinn-std", {}, ""),
    "pinn-std local": ("pinn-std", {"preset": "local"}, ""),
    "pinn-std trained": ("pinn-std", {"preset": "trained"}, ""),
    "pinn-std paper": ("pinn-std", {"preset": "paper", "epochs": 1500}, PAPER),
    "deep-energy": (DEEP, {"width": 30, "layers": 5, "adam": 50, "lbfgs": 350}, BEST),
    "deep-energy-fourier": (
        DEEP,
        {"features": 32, "scale": 2.0, "width": 30, "layers": 2, "adam": 50, "lbfgs": 600},
        BEST,
    ),
    "deepxde": (
        "deepxde_energy:DeepXdeEntry",
        {"layers": 2, "adam": 50, "lbfgs": 700, "rate": 5e-3},
        f"The energy as its loss is ours; {BEST[0].lower()}{BEST[1:]}",
    ),
}
"""A solver, or module and class beside this one; its settings; what differs from its authors' settings."""


def made(name: str) -> Any:
    """The solver of an entry of `ALL`."""
    place, settings, _ = ALL[name]
    module, _, kind = place.partition(":")
    if not kind:
        return make_solver(place, **settings)
    return getattr(import_module(f"benchmarks.entries.{module}"), kind)(**settings)


def run(which: str, rows: str = "", time_limit: float = 600.0) -> Table:
    """Run entries whose names hold a text, keep their files, and write the page."""
    out = Path("out") / f"entries-{which}"
    for name in (each for each in ALL if rows in each):
        notes = {name.split()[0]: ALL[name][2]}
        job = BenchmarkJob(solvers=[made(name)], out=out, which=which, time_limit=time_limit, notes=notes)
        with Stages() as stages:
            (entry,) = run_benchmark(job, stages).entries
        for part in map(problem_set, SETS if which == "full" else [which]):
            rows_of = [row for row in entry.rows if row.problem in {every.name for every in part.problems}]
            replace(entry, problems=part.described, rows=rows_of).save(FOLDER)
    return page()


def page() -> Table:
    """Write tables and pictures of all entries into the page."""
    for which in SETS:
        problems = problem_set(which)
        entries, _ = load_entries(FOLDER, problems)
        order = list(ALL)
        entries.sort(key=lambda each: order.index(each.label) if each.label in order else len(order))
        found = Benchmark(problems, entries)
        if entries:
            draw_accuracy(found).save(DOCS / "pictures" / f"benchmark-{which}.png")
        for name, table in {"entries": summary_table(found), "broken claims": broken_table(found)}.items():
            headings = [heading.replace("-\n", "").replace("\n", " ") for heading in table.headings]
            shown = markdown(headings, table.rows, left=3) if table.rows else "None.\n"
            fill(PAGE, f"{name}: {which}", shown)
    last = summary_table(found)
    return terminal_table(last.title, last.headings, last.rows, left=last.left)


small, full = partial(run, "small"), partial(run, "full")

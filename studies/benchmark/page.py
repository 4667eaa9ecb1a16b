"""The page of the benchmark: broken claims, accuracy over cost, and a table for each problem."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pinnray.runtime.atomic import write_text
from pinnray.runtime.tables import NONE, TextTable, number, percent
from pinnray.studies.benchmark.benchmark import ENTRIES, Benchmark
from pinnray.studies.benchmark.entry import Entry
from pinnray.studies.benchmark.picture import draw_accuracy
from pinnray.studies.benchmark.problems import BenchmarkProblem
from pinnray.studies.benchmark.references import Reference
from pinnray.studies.sweep.page import write_page

PAGE, FIGURES = "benchmark.html", "figures.csv"
COLUMNS: Mapping[str, tuple[str, Callable[[float], str]]] = {
    "displ.,\n%": ("displacement", lambda value: percent(value, 2, sign=False)),
    "v. Mises,\n%": ("von_mises", lambda value: percent(value, 2, sign=False)),
    "away,\n%": ("von_mises_away", lambda value: percent(value, 2, sign=False)),
    "force,\n%": ("force", lambda value: percent(value, 2, sign=False, plus=True)),
    "energy,\n%": ("energy", lambda value: percent(value, 2, sign=False, plus=True)),
    "time,\n× fem": ("times_fem", lambda value: number(value, 2)),
    "memory,\nGB": ("memory", lambda value: number(value, 2)),
}
"""Figure and format by heading."""
MEANINGS = (
    "Displacement and von Mises stress: relative L2 errors over the body; away: a wall's thickness away "
    "from corners and contact. Force and energy: relative, with sign. Time: processor time over that of fem "
    "for the linear problem of the same finger, in the same run. Memory: of the process. ≈: from the best of "
    "the column by less than the reference's error, which does not tell them apart."
)
BOUND, ALIKE = "reference ≤", "≈"
"""The row of the bounds of the reference's error, and the mark of what is no farther from the best."""
LAWS = {True: "linear", False: "finite strain"}


def write_benchmark(found: Benchmark, folder: Path, record: Mapping[str, Any]) -> list[Path]:
    """Write the page, its picture and the table of all figures; returns the paths."""
    tables = [problem_table(problem, found.entries) for problem in found.problems.problems]
    write_text(folder / FIGURES, found.table().to_csv(index=False, lineterminator="\n", float_format="%.6g"))
    caption = (
        "Median error over median time; the numbers are those of the table below. Line: the front, which no "
        "entry beats in both. Open symbols: solved or converged some problems only."
    )
    pages = write_page(
        folder / PAGE,
        "Solvers on the benchmark",
        sentences(found),
        [broken_table(found), summary_table(found), *tables],
        {"front": (draw_accuracy(found), caption)},
        f"{FIGURES}, {ENTRIES}/*.json (an entry each, to send in). Started {record['started']}.",
    )
    return [*pages, folder / FIGURES]


def sentences(found: Benchmark) -> list[str]:
    """The benchmark in sentences."""
    problems = found.problems
    broken = sum(len(row.broken) for entry in found.entries for row in entry.rows)
    return [
        f"{len(found.entries)} entries on the {len(problems.problems)} problems of the set {problems.name}, "
        f"version {problems.version} (SHA-256 {problems.digest[:12]}). {broken} claims are not true"
        f"{', in the first table' * bool(broken)}: what a solver says of its own result is compared with a "
        "reference on graded elements.",
        *(f"{remark[0].upper()}{remark[1:]}." for remark in found.remarks),
    ]


def broken_table(found: Benchmark) -> TextTable:
    """Every claim that is not true."""
    rows = [
        (entry.label, row.problem, claim)
        for entry in found.entries
        for row in entry.rows
        for claim in row.broken
    ]
    headings = ("entry", "problem", "claim")
    return TextTable("Claims that are not true", headings, rows, left=headings)


def summary_table(found: Benchmark) -> TextTable:
    """Medians of each entry over the problems of a law that it solved, below those of the references."""
    rows, numbers, medians = [], [each.label for each in found.entries], found.medians()
    laws = medians.index.get_level_values("linear")
    for linear, law in LAWS.items():
        problems = [each for each in found.problems.problems if each.linear == linear]
        bounds = pd.DataFrame([Reference.load(each).bounds for each in problems]).median().to_dict()
        own = medians[laws == linear].reset_index()
        texts = figure_texts(own.to_dict("records"), bounds)
        rows.append(("", BOUND, law, "", "", *texts[0], ""))
        for (_, each), figures in zip(own.iterrows(), texts[1:], strict=True):
            number, entry = str(numbers.index(each["entry"]) + 1), each["entry"]
            counts = [f"{each[count]:.0f}/{len(problems)}" for count in ("solved", "converged")]
            rows.append((number, entry, law, *counts, *figures, f"{each['broken']:.0f}"))
    headings = ("no.", "entry", "law", "solved", "con-\nverged", *COLUMNS, "broken\nclaims")
    title = "Medians over the problems of each law that an entry solved"
    notes = " ".join(f"{entry.label}: {entry.note}" for entry in found.entries if entry.note)
    return TextTable(title, headings, rows, f"{MEANINGS} {notes}", left=("entry", "law"))


def problem_table(problem: BenchmarkProblem, entries: Sequence[Entry]) -> TextTable:
    """A problem's figures, with the bound of the reference's error and the reasons of failures."""
    rows = [(each.label, next(row for row in each.rows if row.problem == problem.name)) for each in entries]
    shown = [(label, row) for label, row in rows if row.state != "refused"]
    texts = figure_texts([vars(row) for _, row in shown], Reference.load(problem).bounds)
    cells = [(label, *figures, row.state) for (label, row), figures in zip(shown, texts[1:], strict=True)]
    reasons = [f"{label}: {row.message.rstrip('.')}." for label, row in shown if row.state != "done"]
    headings = ("entry", *COLUMNS, "ended")
    return TextTable(
        f"{problem.name}: {problem.words}",
        headings,
        [(BOUND, *texts[0], ""), *cells],
        " ".join(reasons),
        left=("entry", "ended"),
    )


def figure_texts(rows: Sequence[Mapping[str, Any]], bounds: Mapping[str, float]) -> list[list[str]]:
    """The bounds and the figures of rows as texts; a dash where there is none.

    Those that are no farther from the best one than the bound get its mark.
    """
    columns = []
    for figure, shown in COLUMNS.values():
        values = [row[figure] for row in rows]
        sizes = [np.inf if value is None else abs(value) for value in values]
        near = np.array(sizes) <= min(sizes, default=0.0) + bounds.get(figure, -1.0)
        near &= np.isfinite(sizes)
        texts = [NONE if value is None else shown(value) for value in values]
        marked = [f"{text} {ALIKE}" if alike else text for text, alike in zip(texts, near, strict=True)]
        bound = shown(bounds[figure]).replace("+", "") if figure in bounds else NONE
        columns.append([bound, *(marked if near.sum() > 1 else texts)])
    return [list(row) for row in zip(*columns, strict=True)]

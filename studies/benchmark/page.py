"""The page of the benchmark: broken claims, accuracy over cost, and a table for each problem."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pinnray.runtime.atomic import write_text
from pinnray.runtime.tables import NONE, TextTable, number, percent
from pinnray.studies.benchmark.benchmark import ENTRIES, Benchmark
from pinnray.studies.benchmark.entry import Entry, EntryRow
from pinnray.studies.benchmark.picture import draw_front
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
    "for the linear problem of the same finger, in the same run. Memory: of the process."
)
LAWS = {True: "linear", False: "finite strain"}


def write_benchmark(found: Benchmark, folder: Path, record: Mapping[str, Any]) -> list[Path]:
    """Write the page, its picture and the table of all figures; returns the paths."""
    tables = [summary_table(found), *problem_tables(found)]
    write_text(folder / FIGURES, found.table().to_csv(index=False, lineterminator="\n", float_format="%.6g"))
    caption = (
        "Median error over median time; the numbers are those of the table below. Line: the front, which no "
        "entry beats in both. Hollow: not every problem of the law was solved."
    )
    pages = write_page(
        folder / PAGE,
        "Solvers on the benchmark",
        sentences(found),
        [broken_table(found), *tables],
        {"front": (draw_front(found), caption)},
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
    """Medians of each entry over the problems of a law that it solved."""
    rows, numbers = [], [each.label for each in found.entries]
    for (entry, linear), each in found.medians().iterrows():
        count = sum(problem.linear == linear for problem in found.problems.problems)
        figures = [shown(float(each[figure])) for figure, shown in COLUMNS.values()]
        said = (str(numbers.index(entry) + 1), entry, LAWS[linear], f"{each['solved']:.0f}/{count}")
        rows.append((*said, *figures, f"{each['broken']:.0f}"))
    headings = ("no.", "entry", "law", "solved", *COLUMNS, "broken\nclaims")
    title = "Medians over the problems of each law that an entry solved"
    return TextTable(title, headings, rows, f"{MEANINGS} {_notes(found.entries)}", left=("entry", "law"))


def problem_tables(found: Benchmark) -> list[TextTable]:
    """A table for each problem, with the bound of the reference's error and the reasons of failures."""
    return [_problem_table(problem, found.entries) for problem in found.problems.problems]


def _problem_table(problem: BenchmarkProblem, entries: Sequence[Entry]) -> TextTable:
    bounds = Reference.load(problem).bounds
    known = [(figure, shown) for figure, shown in COLUMNS.values()]
    limits = [shown(bounds[figure]).replace("+", "") if figure in bounds else NONE for figure, shown in known]
    rows, reasons = [("reference ≤", *limits, "")], []
    for entry in entries:
        row = next(each for each in entry.rows if each.problem == problem.name)
        if row.solved:
            rows.append((entry.label, *(_shown(row, *each) for each in known), row.state))
        elif row.state != "refused":
            rows.append((entry.label, *[NONE] * len(known), row.state))
            reasons.append(f"{entry.label}: {row.message}")
    headings = ("entry", *COLUMNS, "ended")
    return TextTable(
        f"{problem.name}: {problem.words}", headings, rows, " ".join(reasons), left=("entry", "ended")
    )


def _shown(row: EntryRow, figure: str, shown: Callable[[float], str]) -> str:
    """A figure of a row; a dash where there is none."""
    value = getattr(row, figure)
    return NONE if value is None else shown(value)


def _notes(entries: Sequence[Entry]) -> str:
    return " ".join(f"{entry.label}: {entry.note}" for entry in entries if entry.note)

"""Tables of the default run in README.md, docs/results.md and paper/paper.md; about a minute.

Runs `compare --design default` into `out/default`, keeps its figures in `docs/default-run.csv` and writes
them between the marks of the pages.
"""

import csv
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rich.table import Table

from compare.cli import compare_main
from geometry.atomic import write_text
from geometry.errors import UserError

ROOT = Path(__file__).parents[1]
RUN = ROOT / "out" / "default" / "metrics.json"
FIGURES = ROOT / "docs" / "default-run.csv"

MEANINGS = {
    "fem": "finite elements",
    "fem-nonlinear": "finite elements, large deformation",
    "pinn-std": "neural network",
    "pinn-asm": "neural network, given the markers",
    "fem-asm": "finite elements, given the markers",
    "fem-id": "finite elements; contact, force, walls and law found from the markers",
    "gp": "interpolation of the markers, no mechanics",
    "statfem": "finite elements, corrected by interpolated markers",
}
SHOWN = ("fem", "pinn-std", "pinn-asm", "fem-id")
"""Solvers of the table in the README."""


class Figures(NamedTuple):
    """Figures of one solver: errors in mm, relative errors without unit, time in s; None: not applicable."""

    solver: str
    given_u: float | None
    given_v: float | None
    held_out_u: float | None
    held_out_v: float | None
    held_out_rss: float | None
    from_fem: float | None
    above_fem: float | None
    displacement: float
    von_mises: float
    force: float
    seconds: float


def figures(metrics: Mapping[str, Any]) -> list[Figures]:
    """The figures of every solver out of a run's `metrics.json`."""
    return [_figures(name, entry) for name, entry in metrics["solvers"].items()]


def _figures(name: str, entry: Mapping[str, Any]) -> Figures:
    given = entry["markers"] if entry["markers"]["in_sample"] else {}
    held_out = entry["held_out"] or {}
    certificate = entry["certificate"] or {}
    return Figures(
        name,
        given.get("mae_u"),
        given.get("mae_v"),
        *(held_out.get(key) for key in ("mae_u", "mae_v", "mae_rss")),
        None if name == "fem" else entry["to_reference"]["displacement"]["rel_l2"],
        certificate.get("rel_excess"),
        entry["to_truth"]["displacement"]["rel_l2"],
        entry["to_truth"]["von_mises"]["rel_l2"],
        entry["force_to_truth_rel"],
        entry["seconds"],
    )


def kept_figures() -> list[Figures]:
    """The figures as they were kept."""
    with FIGURES.open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))[1:]
    return [Figures(name, *(float(cell) if cell else None for cell in cells)) for name, *cells in rows]  # type: ignore[arg-type]


def short_table(rows: Sequence[Figures]) -> str:
    """The table of the README and the paper."""
    header = ("solver", "what it is", "markers (rss), mm", "displacement", "stress", "force")
    cells = [
        (
            f"`{each.solver}`",
            MEANINGS[each.solver],
            _mm(each.held_out_rss),
            *(_percent(value) for value in (each.displacement, each.von_mises, each.force)),
        )
        for each in rows
        if each.solver in SHOWN
    ]
    return _markdown(header, cells, left=2)


def marker_table(rows: Sequence[Figures]) -> str:
    """Errors at the markers, for the page of results."""
    header = ("solver", "what it is", "given: u", "v", "held out: u", "v", "rss")
    cells = [(f"`{each.solver}`", MEANINGS[each.solver], *map(_mm, each[1:6])) for each in rows]
    return _markdown(header, cells, left=2)


def body_table(rows: Sequence[Figures]) -> str:
    """Errors over the body, for the page of results."""
    header = ("solver", "from `fem`", "energy above `fem`", "displacement", "stress", "force", "time, s")
    cells = [(f"`{each.solver}`", *map(_percent, each[6:11]), f"{each.seconds:.1f}") for each in rows]
    return _markdown(header, cells, left=1)


TABLES = {"short": short_table, "markers": marker_table, "body": body_table}
PAGES = {
    ROOT / "README.md": ("short",),
    ROOT / "docs" / "results.md": ("markers", "body"),
    ROOT / "paper" / "paper.md": ("short",),
}


def marks(name: str) -> tuple[str, str]:
    """The lines before and after a table on its page."""
    return f"<!-- default run: {name} -->\n", "<!-- end of the table -->\n"


def main() -> Table:
    """Run the comparison, keep its figures and write the pages' tables."""
    if code := compare_main(["--design", "default", "--out", str(RUN.parent), "--quiet"]):
        raise UserError(f"compare --design default ended with code {code}")
    write(json.loads(RUN.read_text(encoding="utf-8")))
    table = Table(*Figures._fields, title="compare --design default")
    for row in kept_figures():
        table.add_row(*("" if value is None else str(value) for value in row))
    return table


def write(metrics: Mapping[str, Any]) -> None:
    """Keep the figures of a run and write the pages' tables."""
    rows = [["" if value is None else str(value) for value in each] for each in figures(metrics)]
    write_text(FIGURES, "".join(f"{','.join(row)}\n" for row in (list(Figures._fields), *rows)))
    for page, tables in PAGES.items():
        text = page.read_text(encoding="utf-8")
        for name in tables:
            begin, end = marks(name)
            before, _, rest = text.partition(begin)
            text = f"{before}{begin}{TABLES[name](kept_figures())}{end}{rest.partition(end)[2]}"
        write_text(page, text)


def _markdown(header: Sequence[str], rows: Sequence[Sequence[str]], left: int) -> str:
    rule = ["---"] * left + ["---:"] * (len(header) - left)
    return "".join(f"| {' | '.join(cells)} |\n" for cells in (header, rule, *rows))


def _mm(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"


def _percent(value: float | None) -> str:
    """Two digits and the unit; rounding errors are zero."""
    if value is None:
        return ""
    if abs(value) < 1e-12:
        return "0 %"
    return f"{float(f'{100 * value:.2g}'):g} %".replace("-", "−")

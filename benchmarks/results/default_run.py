"""Tables of the default run in README.md, docs/results.md and paper/paper.md; about a minute.

Runs `compare --design default` into `out/default`, keeps its figures in `docs/default-run.csv` and writes
them between the marks of the pages.
"""

import json
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from rich.table import Table

from benchmarks.tables import DOCS, fill, keep_rows, kept_rows, markdown
from pinnray.cli import compare_main
from pinnray.runtime.errors import UserError
from pinnray.runtime.tables import percent, terminal_table

ROOT = DOCS.parent
RUN = ROOT / "out" / "default" / "metrics.json"
FIGURES = DOCS / "default-run.csv"

MEANINGS = {
    "fem": "finite elements",
    "fem-nonlinear": "finite elements, large deformation",
    "pinn-std": "neural network",
    "pinn-asm": "neural network, given the markers",
    "fem-asm": "finite elements, given the markers",
    "fem-id": "finite elements; contact, force, walls and law found from the markers",
    "pinn-id": "neural network; contact, force, walls and law found from the markers",
    "gp": "interpolation of the markers, no mechanics",
}
SHORT = ("fem", "pinn-std", "pinn-asm", "fem-id", "pinn-id")
"""Solvers of the table in the README."""


class Figures(NamedTuple):
    """Errors of one solver in mm, relative errors without unit, time in s; None: not applicable."""

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

    @property
    def held_out_sum(self) -> float | None:
        """Mean of |Δu| + |Δv| at markers that were not given, mm, as in report and terminal."""
        return (
            None if self.held_out_u is None or self.held_out_v is None else self.held_out_u + self.held_out_v
        )


def figures_of(name: str, entry: Mapping[str, Any]) -> Figures:
    """The figures of a solver out of its entry in a run's `metrics.json`."""
    given = entry["markers"] if entry["markers"]["in_sample"] else {}
    held_out = entry["held_out"] or {}
    return Figures(  # type: ignore[call-arg]
        name,
        given.get("mae_u"),
        given.get("mae_v"),
        *(held_out.get(key) for key in ("mae_u", "mae_v", "mae_rss")),
        None if name == "fem" else entry["to_reference"]["displacement"]["rel_l2"],
        (entry["certificate"] or {}).get("rel_excess"),
        entry["to_truth"]["displacement"]["rel_l2"],
        entry["to_truth"]["von_mises"]["rel_l2"],
        entry["force_to_truth_rel"],
        entry["seconds"],
    )


def kept_figures() -> list[Figures]:
    """The figures as they were kept."""
    return kept_rows(FIGURES, Figures)


def short_table(rows: Sequence[Figures]) -> str:
    """The table of the README and the paper."""
    header = ("solver", "what it is", "markers, mm", "displacement", "stress", "force")
    chosen = [each for each in rows if each.solver in SHORT]
    cells = [(*_names(each), _mm(each.held_out_sum), *_to_truth(each)) for each in chosen]
    return markdown(header, cells, left=2)


def marker_table(rows: Sequence[Figures]) -> str:
    """Errors at the markers, for the page of results."""
    header = ("solver", "what it is", "given: u", "v", "held out: u", "v", "rss")
    return markdown(header, [(*_names(each), *map(_mm, each[1:6])) for each in rows], left=2)


def body_table(rows: Sequence[Figures]) -> str:
    """Errors over the body, for the page of results."""
    header = ("solver", "from `fem`", "energy above `fem`", "displacement", "stress", "force", "time, s")
    cells = [
        (_names(each)[0], *map(_percent, each[6:8]), *_to_truth(each), f"{each.seconds:.1f}") for each in rows
    ]
    return markdown(header, cells)


TABLES = {
    "default run: short": short_table,
    "default run: markers": marker_table,
    "default run: body": body_table,
}
PAGES = {
    ROOT / "README.md": ("default run: short",),
    DOCS / "results.md": ("default run: markers", "default run: body"),
    ROOT / "paper" / "paper.md": ("default run: short",),
}


def main() -> Table:
    """Run the comparison, keep its figures and write the pages' tables."""
    if code := compare_main(["--design", "default", "--out", str(RUN.parent), "--quiet"]):
        raise UserError(f"compare --design default ended with code {code}")
    solvers = json.loads(RUN.read_text(encoding="utf-8"))["solvers"]
    keep_rows(FIGURES, Figures, [figures_of(name, entry) for name, entry in solvers.items()])
    rows = kept_figures()
    for page, names in PAGES.items():
        for name in names:
            fill(page, name, TABLES[name](rows))
    cells = [["" if value is None else str(value) for value in row] for row in rows]
    return terminal_table("compare --design default", Figures._fields, cells, left=["solver"])


def _names(row: Figures) -> tuple[str, str]:
    return f"`{row.solver}`", MEANINGS[row.solver]


def _mm(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"


def _to_truth(row: Figures) -> tuple[str, str, str]:
    return _percent(row.displacement), _percent(row.von_mises), _percent(row.force, plus=True)


def _percent(value: float | None, *, plus: bool = False) -> str:
    """Two digits and the unit; rounding errors are zero."""
    if value is None:
        return ""
    return percent(value if abs(value) > 1e-12 else 0.0, 2, plus=plus).replace("\N{NO-BREAK SPACE}", " ")

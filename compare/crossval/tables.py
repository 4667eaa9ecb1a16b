"""A cross-validation as tables for the terminal, the report and CSV files."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isnan
from pathlib import Path

from rich.table import Table

from compare.crossval.folds import ALL, SCHEMES, SeedResults
from compare.crossval.result import BASELINES, CrossvalResult
from compare.crossval.scores import FIELDS, LEVEL, Difference, Interval
from compare.evaluation.number_format import NONE, percent, significant
from compare.runtime.tables import Cell, terminal_table, write_csv

SHORT = {"not told apart": "≈"}
"""Short forms of verdicts."""

CAPTION = (
    "Given: in-sample, at markers that were given. Held out: at markers that were not. sum: mean of "
    "|Δu| + |Δv|; rss: √(u² + v²) of the two means. ±: Student's interval of the sum over seeds, which "
    "differ in noise alone. vs: whether the sum is better or worse, by a bootstrap over folds and seeds; "
    "≈: not told apart. Within: share of held-out errors within the interval of "
    f"{LEVEL:.0%} that the solver states."
)


@dataclass(frozen=True)
class Grid:
    """A table of texts.

    Attributes:
        title: Above the table.
        headings: Headings of the columns.
        rows: As many texts as headings.
        caption: Below the table.
    """

    title: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""


def grids(result: CrossvalResult) -> list[Grid]:
    """One table of the markers for each scheme, and one of the fields."""
    held = [scheme for scheme in result.schemes if scheme != ALL]
    markers = [
        Grid(
            f"{scheme}: {SCHEMES[scheme]}; mm",
            ["solver", "given\nsum", "held\nout u", "v", "sum", "±", "rss", "vs\nfem", "vs\ngp", "with-\nin"],
            [_marker_row(result, label, scheme) for label in result.scores],
            CAPTION if scheme == held[-1] else "",
        )
        for scheme in held
    ]
    return [*markers, *([_field_grid(result)] if result.has_fields else [])]


def tables(result: CrossvalResult) -> list[Table]:
    """The tables of `grids` for the terminal."""
    left = ("solver", "held out")
    return [
        terminal_table(grid.title, grid.headings, grid.rows, caption=grid.caption, left=left, narrow=True)
        for grid in grids(result)
    ]


def write_tables(out: Path, result: CrossvalResult, results: Mapping[str, SeedResults]) -> None:
    """Write the CSV files: markers and fields by scheme, and every error of every fold."""
    write_csv(out / "held_out.csv", result.held_out_rows())
    if result.has_fields:
        write_csv(out / "fields.csv", result.field_rows())
    write_csv(out / "folds.csv", list(_fold_rows(results)))


def _fold_rows(results: Mapping[str, SeedResults]) -> Iterable[dict[str, Cell]]:
    for label, seeds in results.items():
        for seed, folds in enumerate(seeds):
            for found in folds:
                for marker, (u, v) in enumerate(found.errors):
                    yield {
                        "solver": label,
                        "seed": seed,
                        "scheme": found.fold.scheme,
                        "fold": found.fold.name,
                        "marker": marker + 1,
                        "held_out": int(marker in found.held),
                        "error_u_mm": u,
                        "error_v_mm": v,
                    }


def _marker_row(result: CrossvalResult, label: str, scheme: str) -> list[str]:
    score = result.scores[label][scheme]
    held, total = score.held_out, score.held_out.get("mae_sum")
    return [
        label,
        _mm(score.in_sample.get("mae_sum")),
        *(_mm(held.get(name)) for name in ("mae_u", "mae_v", "mae_sum")),
        NONE if total is None or isnan(total.high) else significant(total.high - total.mean, 1),
        _mm(held.get("mae_rss")),
        *(_verdict(result.difference(label, baseline, scheme, "mae_sum")) for baseline in BASELINES),
        NONE if score.coverage is None else f"{100 * score.coverage:.0f} %",
    ]


def _field_grid(result: CrossvalResult) -> Grid:
    """Relative L2 distances from the truth, a row for each scheme and solver."""
    rows = []
    for scheme in result.schemes:
        for label, scores in result.scores.items():
            *values, last = [percent(scores[scheme].fields[name].mean, 2, sign=False) for name in FIELDS]
            verdicts = [_verdict(result.difference(label, "fem", scheme, name)) for name in FIELDS[:-1]]
            pairs = [text for pair in zip(values, verdicts, strict=True) for text in pair]
            rows.append([scheme, label, *pairs, last])
    headings = ["held out", "solver", "displ.", "vs\nfem", "strain", "vs\nfem", "v.\nMises", "vs\nfem"]
    return Grid(
        "Relative L2 distance from the truth over the body, %",
        [*headings, "truth's\nlaw"],
        rows,
        f"{ALL}: {SCHEMES[ALL]}. Strain: of the solver's own law, Green-Lagrange for finite strain. Truth's "
        "law: the von Mises stress that the neo-Hookean law gives for the solver's displacement gradient. "
        "vs fem: better or worse, by a bootstrap over folds and seeds; ≈: not told apart.",
    )


def _verdict(difference: Difference | None) -> str:
    return NONE if difference is None else SHORT.get(difference.verdict, difference.verdict)


def _mm(interval: Interval | None) -> str:
    return NONE if interval is None else f"{interval.mean:.3f}"

"""A cross-validation as tables for the terminal, the report and CSV files."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import isnan
from pathlib import Path

from rich.table import Table
from rich.text import Text

from compare.crossval.folds import ALL, SCHEMES, SeedResults
from compare.crossval.result import Case, CrossvalResult, LayoutResult
from compare.crossval.scores import FIELDS, LEVEL, Difference, Interval
from compare.crossval.truth_summary import truth_grids, truth_rows
from compare.runtime.tables import NONE, Cell, TextTable, percent, significant, terminal_table, write_csv

SHORT = {"not told apart": "≈"}
"""Short forms of verdicts."""

CAPTION = (
    "Given: in-sample, at markers that were given. Held out: at markers that were not. sum: mean of "
    "|Δu| + |Δv|; rss: √(u² + v²) of the two means. ±: Student's interval of the sum over seeds, which "
    "differ in noise alone. vs: whether the sum is better or worse, by a bootstrap over folds and seeds; "
    "≈: not told apart. Within: share of held-out errors within the interval of "
    f"{LEVEL:.0%} that the solver states."
)


def grids(result: CrossvalResult) -> list[TextTable]:
    """Solvers by truths, one table of the markers for each scheme, and one of the fields."""
    held = [scheme for scheme in result.schemes if scheme != ALL]
    headings = [
        "solver",
        "given\nsum",
        "held\nout u",
        "v",
        "sum",
        "±",
        "rss",
        "vs\nfem",
        "vs\ngp",
        "with-\nin",
    ]
    markers = [
        TextTable(
            f"{scheme}: {SCHEMES[scheme]}; {result.study.label} markers, mm",
            headings,
            _by_case(result, _marker_row, [scheme]),
            CAPTION if scheme == held[-1] else "",
        )
        for scheme in held
    ]
    return [*truth_grids(result), *markers, *([_field_grid(result)] if result.has_fields else [])]


def tables(result: CrossvalResult) -> list[Table | Text]:
    """The tables of `grids` and their captions; with several truths those of solvers by truths alone."""
    left = ("solver", "held out", "truth", "layout")
    shown: list[Table | Text] = []
    for grid in truth_grids(result) if len(result.truths) > 1 else grids(result):
        shown.append(terminal_table(grid.title, grid.headings, grid.rows, left=left, narrow=True))
        if grid.caption:  # apart from the table, which may be much narrower than the terminal
            shown.append(Text(f"{grid.caption}\n", style="table.caption"))
    return shown


def write_tables(
    out: Path, result: CrossvalResult, results: Mapping[Case, Mapping[str, SeedResults]]
) -> None:
    """Write the CSV files: markers and fields by scheme, every error of every fold, solvers by truths."""
    write_csv(out / "held_out.csv", result.held_out_rows())
    if result.has_fields:
        write_csv(out / "fields.csv", result.field_rows())
    if result.study.chosen_truths:
        write_csv(out / "truths.csv", truth_rows(result))
    write_csv(
        out / "folds.csv", [case.cells | row for case, each in results.items() for row in _fold_rows(each)]
    )


def _by_case(
    result: CrossvalResult,
    row: Callable[[LayoutResult, str, str], list[str]],
    schemes: Sequence[str],
) -> list[list[str]]:
    """The rows of all solvers in all schemes, those of each truth and layout below its name if several."""
    rows: list[list[str]] = []
    for case, each in result.cases.items():
        own = [row(each, label, scheme) for scheme in schemes for label in each.scores]
        if said := case.said_among(result.cases):
            rows.append([said if len(result.truths) > 1 else f"markers: {said}", *[""] * (len(own[0]) - 1)])
        rows += own
    return rows


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


def _marker_row(result: LayoutResult, label: str, scheme: str) -> list[str]:
    score = result.scores[label][scheme]
    held, total = score.held_out, score.held_out.get("mae_sum")
    return [
        label,
        _mm(score.in_sample.get("mae_sum")),
        *(_mm(held.get(name)) for name in ("mae_u", "mae_v", "mae_sum")),
        NONE if total is None or isnan(total.high) else significant(total.high - total.mean, 1),
        _mm(held.get("mae_rss")),
        *(_verdict(result.difference(label, baseline, scheme, "mae_sum")) for baseline in ("fem", "gp")),
        NONE if score.coverage is None else f"{100 * score.coverage:.0f} %",
    ]


def _field_grid(result: CrossvalResult) -> TextTable:
    """Relative L2 distances from the truth, a row for each scheme and solver."""
    headings = ["solver", "held out", "displ.", "vs\nfem", "strain", "vs\nfem", "v.\nMises", "vs\nfem"]
    return TextTable(
        "Relative L2 distance from the truth over the body, %",
        [*headings, "truth's\nlaw"],
        _by_case(result, _field_row, result.schemes),
        f"{ALL}: {SCHEMES[ALL]}. Strain: of the solver's own law, Green-Lagrange for finite strain. Truth's "
        "law: the von Mises stress that the law of the truth gives for the solver's displacement gradient. "
        "vs fem: better or worse, by a bootstrap over folds and seeds; ≈: not told apart.",
    )


def _field_row(result: LayoutResult, label: str, scheme: str) -> list[str]:
    fields = result.scores[label][scheme].fields
    *values, last = [percent(fields[name].mean, 2, sign=False) for name in FIELDS]
    verdicts = [_verdict(result.difference(label, "fem", scheme, name)) for name in FIELDS[:-1]]
    pairs = [text for pair in zip(values, verdicts, strict=True) for text in pair]
    return [label, scheme, *pairs, last]


def _verdict(difference: Difference | None) -> str:
    return NONE if difference is None else SHORT.get(difference.verdict, difference.verdict)


def _mm(interval: Interval | None) -> str:
    return NONE if interval is None else f"{interval.mean:.3f}"

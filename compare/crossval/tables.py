"""A cross-validation as tables for the terminal, the report and CSV files."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isnan
from pathlib import Path

from rich.table import Table

from compare.crossval.fold_result import SeedResults
from compare.crossval.folds import ALL, SCHEMES
from compare.crossval.result import BASELINES, CrossvalResult
from compare.crossval.scores import FIELDS, LEVEL, MARKERS, Difference, Interval
from compare.evaluation.number_format import NONE, percent, significant
from compare.runtime.csv_files import Cell, write_csv
from compare.runtime.terminal_table import terminal_table

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
        headings: Of the columns.
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
    write_csv(out / "held_out.csv", held_out_rows(result))
    if result.has_fields:
        write_csv(out / "fields.csv", field_rows(result))
    write_csv(out / "folds.csv", list(_fold_rows(results)))


def held_out_rows(result: CrossvalResult) -> list[dict[str, Cell]]:
    """Errors at given and held-out markers, a row for each solver and scheme."""
    rows: list[dict[str, Cell]] = []
    for label, scores in result.scores.items():
        for scheme, score in scores.items():
            row: dict[str, Cell] = {"solver": label, "scheme": scheme}
            for kind, errors in (("in_sample", score.in_sample), ("held_out", score.held_out)):
                for name in MARKERS:
                    row |= _interval_cells(f"{kind}_{name}", "_mm", errors.get(name))
            row["within_stated"] = "" if score.coverage is None else score.coverage
            row |= _difference_cells(result, label, scheme, "mae_sum", "_mm")
            rows.append(row | {"converged": score.converged})
    return rows


def field_rows(result: CrossvalResult) -> list[dict[str, Cell]]:
    """Relative L2 distances from the truth, a row for each solver, scheme and field."""
    return [
        {"solver": label, "scheme": scheme, "field": name}
        | _interval_cells("rel_l2", "", interval)
        | _difference_cells(result, label, scheme, name, "")
        for label, scores in result.scores.items()
        for scheme, score in scores.items()
        for name, interval in score.fields.items()
    ]


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


def _interval_cells(name: str, unit: str, interval: Interval | None, mean: str = "") -> dict[str, Cell]:
    values = (None, None, None) if interval is None else (interval.mean, interval.low, interval.high)
    return {
        f"{name}{end}{unit}": "" if value is None or isnan(value) else value
        for end, value in zip((mean, "_low", "_high"), values, strict=True)
    }


def _difference_cells(
    result: CrossvalResult, label: str, scheme: str, what: str, unit: str
) -> dict[str, Cell]:
    row: dict[str, Cell] = {}
    for baseline in BASELINES:
        found = result.difference(label, baseline, scheme, what)
        row |= _interval_cells(f"from_{baseline}", unit, found, "_mean")
        row[f"from_{baseline}"] = found.verdict if found else ""
    return row


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

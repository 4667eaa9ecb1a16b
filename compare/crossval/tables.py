"""A cross-validation as tables for the terminal, the report and CSV files."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isnan
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.table import Table

from compare.crossval.fold_result import FoldResult
from compare.crossval.folds import ALL, ONE, SCHEMES
from compare.crossval.result import BASELINES, CrossvalResult
from compare.crossval.scores import FIELDS, LEVEL, MARKERS, Difference, Interval, Score
from compare.evaluation.number_format import NONE, percent, significant
from compare.runtime.csv_files import Cell, write_csv

SHORT = {"not told apart": "≈"}
"""Of verdicts, where there is no room."""

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
        title: Above it.
        headings: Of the columns.
        rows: Texts, as many as headings.
        caption: Below it.
    """

    title: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""


def grids(result: CrossvalResult) -> list[Grid]:
    """One table of the markers for each scheme, and one of the fields."""
    held = [scheme for scheme in result.schemes if scheme != ALL]
    found = [
        Grid(
            f"{scheme}: {SCHEMES[scheme]}; mm",
            ["solver", "given\nsum", "held\nout u", "v", "sum", "±", "rss", "vs\nfem", "vs\ngp", "with-\nin"],
            [_marker_row(result, label, scheme) for label in result.scores],
            CAPTION if scheme == held[-1] else "",
        )
        for scheme in held
    ]
    return [*found, *([_fields(result)] if has_fields(result) else [])]


def tables(result: CrossvalResult) -> list[Table]:
    """The same for the terminal."""
    return [_rich(grid) for grid in grids(result)]


def write_tables(
    out: Path, result: CrossvalResult, outcomes: Mapping[str, Sequence[Sequence[FoldResult]]]
) -> None:
    """Write the CSV files: markers and fields by scheme, and every error of every fold."""
    write_csv(out / "held_out.csv", list(_markers_csv(result)))
    if has_fields(result):
        write_csv(out / "fields.csv", list(_fields_csv(result)))
    write_csv(out / "folds.csv", list(_folds_csv(outcomes)))


def _rich(grid: Grid) -> Table:
    table = Table(
        title=grid.title,
        caption=grid.caption,
        box=SIMPLE_HEAD,
        padding=0,
        pad_edge=False,
        title_justify="left",
        caption_justify="left",
    )
    for heading in grid.headings:
        table.add_column(
            heading, justify="left" if heading in ("solver", "held out") else "right", no_wrap=True
        )
    for row in grid.rows:
        table.add_row(*row)
    return table


def _marker_row(result: CrossvalResult, label: str, scheme: str) -> list[str]:
    score = result.scores[label][scheme]
    against = (result.differences[label].get(baseline, {}).get(scheme, {}) for baseline in BASELINES)
    verdicts = [_verdict(each.get("mae_sum")) for each in against]
    held = score.held_out
    return [
        label,
        _mm(score.in_sample.get("mae_sum")),
        _mm(held.get("mae_u")),
        _mm(held.get("mae_v")),
        _mm(held.get("mae_sum")),
        _half(held.get("mae_sum")),
        _mm(held.get("mae_rss")),
        *verdicts,
        NONE if score.coverage is None else f"{100 * score.coverage:.0f} %",
    ]


def _verdict(difference: Difference | None) -> str:
    return NONE if difference is None else SHORT.get(difference.verdict, difference.verdict)


def _mm(interval: Interval | None) -> str:
    return NONE if interval is None else f"{interval.mean:.3f}"


def _half(interval: Interval | None) -> str:
    if interval is None or isnan(interval.high):
        return NONE
    return significant(interval.high - interval.mean, 1)


def has_fields(result: CrossvalResult) -> bool:
    """Whether there is a truth to compare fields with."""
    return any(score.fields for each in result.scores.values() for score in each.values())


def _fields(result: CrossvalResult) -> Grid:
    """Relative L2 distances from the truth, a row a solver and scheme."""
    rows = []
    for scheme in result.schemes:
        for label, scores in result.scores.items():
            against = result.differences[label].get("fem", {}).get(scheme, {})
            verdicts = [_verdict(against.get(name)) for name in FIELDS[:3]]
            values = [percent(scores[scheme].fields[name].mean, 2, sign=False) for name in FIELDS]
            pairs = [text for pair in zip(values, verdicts, strict=False) for text in pair]
            rows.append([scheme, label, *pairs, values[-1]])
    headings = ["held out", "solver", "displ.", "vs\nfem", "strain", "vs\nfem", "v.\nMises", "vs\nfem"]
    return Grid(
        "Relative L2 distance from the truth over the body, %",
        [*headings, "truth's\nlaw"],
        rows,
        f"{ALL}: {SCHEMES[ALL]}. Strain: of the solver's own law, Green-Lagrange for finite strain. Truth's "
        "law: the von Mises stress that the neo-Hookean law gives for the solver's displacement gradient. "
        "vs fem: better or worse, by a bootstrap over folds and seeds; ≈: not told apart.",
    )


def _markers_csv(result: CrossvalResult) -> list[dict[str, Cell]]:
    rows: list[dict[str, Cell]] = []
    for label, scores in result.scores.items():
        for scheme, score in scores.items():
            row: dict[str, Cell] = {"solver": label, "scheme": scheme}
            for kind, errors in (("in_sample", score.in_sample), ("held_out", score.held_out)):
                for name in MARKERS:
                    row |= _interval_cells(f"{kind}_{name}", "_mm", errors.get(name))
            row["within_stated"] = "" if score.coverage is None else score.coverage
            row |= _against_cells(result, label, scheme, "mae_sum", "_mm")
            row["converged"] = score.converged
            rows.append(row)
    return rows


def _fields_csv(result: CrossvalResult) -> list[dict[str, Cell]]:
    rows: list[dict[str, Cell]] = []
    for label, scores in result.scores.items():
        for scheme, score in scores.items():
            for name, interval in score.fields.items():
                row: dict[str, Cell] = {"solver": label, "scheme": scheme, "field": name}
                row |= _interval_cells("rel_l2", "", interval)
                rows.append(row | _against_cells(result, label, scheme, name, ""))
    return rows


def _interval_cells(name: str, unit: str, interval: Interval | None) -> dict[str, Cell]:
    ends = {"": "mean", "_low": "low", "_high": "high"}
    return {f"{name}{end}{unit}": _cell(getattr(interval, key, None)) for end, key in ends.items()}


def _against_cells(result: CrossvalResult, label: str, scheme: str, what: str, unit: str) -> dict[str, Cell]:
    row: dict[str, Cell] = {}
    for baseline in BASELINES:
        found = result.differences[label].get(baseline, {}).get(scheme, {}).get(what)
        for key in ("mean", "low", "high"):
            row[f"from_{baseline}_{key}{unit}"] = _cell(getattr(found, key, None))
        row[f"from_{baseline}"] = found.verdict if found else ""
    return row


def _cell(value: float | None) -> Cell:
    return "" if value is None or isnan(value) else value


def _folds_csv(outcomes: Mapping[str, Sequence[Sequence[FoldResult]]]) -> list[dict[str, Cell]]:
    rows: list[dict[str, Cell]] = []
    for label, seeds in outcomes.items():
        for seed, folds in enumerate(seeds):
            for outcome in folds:
                held = set(outcome.held)
                for marker, (u, v) in enumerate(outcome.errors):
                    row: dict[str, Cell] = {"solver": label, "seed": seed, "scheme": outcome.fold.scheme}
                    row |= {"fold": outcome.fold.name, "marker": marker + 1}
                    row |= {"held_out": int(marker in held), "error_u_mm": u, "error_v_mm": v}
                    rows.append(row)
    return rows


def per_marker(result: CrossvalResult) -> dict[str, Sequence[float]]:
    """Held-out error of every marker by solver, if each was held out in its turn."""
    if ONE not in result.schemes:
        return {}
    scores: dict[str, Score] = {label: each[ONE] for label, each in result.scores.items()}
    return {label: score.per_marker for label, score in scores.items()}

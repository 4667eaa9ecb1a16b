"""A cross-validation as tables of texts."""

from collections.abc import Callable, Mapping, Sequence
from math import isnan, nan

import pandas as pd

from pinnray.runtime.tables import NONE, TextTable, distance, percent, significant
from pinnray.studies.crossval.folds import ALL, SCHEMES
from pinnray.studies.crossval.result import CrossvalResult
from pinnray.studies.crossval.scores import BASELINES, CASE, HELD_OUT, LEVEL

VERDICTS = {"better": "better", "worse": "worse", "not told apart": "≈"}
Format = Callable[[pd.Series], str]
"""Turns a row of the table of scores into a text."""


def _mm(row: pd.Series) -> str:
    return f"{row['mean']:.3f}"


def _small(row: pd.Series) -> str:
    return distance(row["mean"])


def _percent(row: pd.Series) -> str:
    return percent(row["mean"], 2, sign=False)


def _half(row: pd.Series) -> str:
    return NONE if isnan(row["high"]) else significant(row["high"] - row["mean"], 1)


def _against(baseline: str) -> Format:
    return lambda row: VERDICTS.get(row.get(f"against_{baseline}", nan), NONE)


MARKERS: Mapping[str, tuple[str, Format]] = {
    "given\nsum": ("in_sample_mae_sum_mm", _mm),
    "held\nout u": ("held_out_mae_u_mm", _mm),
    "v": ("held_out_mae_v_mm", _mm),
    "sum": (HELD_OUT, _mm),
    "±": (HELD_OUT, _half),
    "rss": ("held_out_mae_rss_mm", _mm),
    **{f"vs\n{baseline}": (HELD_OUT, _against(baseline)) for baseline in BASELINES},
    "with-\nin": ("within_stated", _percent),
}
FIELDS: Mapping[str, tuple[str, Format]] = {
    "displ.": ("displacement", _percent),
    "vs\nfem": ("displacement", _against("fem")),
    "strain": ("strain", _percent),
    "vs\nfem ": ("strain", _against("fem")),
    "v.\nMises": ("von_mises", _percent),
    "vs\nfem  ": ("von_mises", _against("fem")),
    "truth's\nlaw": ("von_mises_true_law", _percent),
}
TRUTHS: Mapping[str, tuple[str, Format]] = {
    "v.\nMises": ("von_mises", _percent),
    "force": ("force_error", _percent),
    "±": ("force_half_width", _percent),
    "within:\nv. Mises": ("von_mises_within_stated", _percent),
    "\nforce": ("force_within_stated", _percent),
    "tan-\ngent.": ("tangential_within_stated", _percent),
    "\nplace": ("position_within_stated", _percent),
}
CAPTION = (
    "Given: in-sample, at markers that were given. Held out: at markers that were not. sum: mean of "
    "|Δu| + |Δv|; rss: √(u² + v²) of the two means. ±: Student's interval of the sum over seeds, which "
    "differ in noise alone. vs: whether the sum is better or worse, by a bootstrap over folds and seeds; "
    f"≈: not told apart. Within: share, %, of held-out errors within the interval of {LEVEL:.0%} that the "
    "solver states."
)


def all_tables(result: CrossvalResult) -> list[TextTable]:
    """One table of the markers for each scheme, one of the fields, and one of the truths."""
    tables = []
    for scheme in (each for each in result.schemes if each != ALL):
        title = f"{scheme}: {SCHEMES[scheme]}; {result.study.label} markers, mm"
        tables.append(TextTable(title, *_grid(result, [scheme], MARKERS), CAPTION))
    return [*tables, *truth_tables(result)]


def truth_tables(result: CrossvalResult) -> list[TextTable]:
    """The tables of a result that need a truth; the last one is short."""
    if not result.truths:
        return []
    simulations = dict.fromkeys(truth.simulation for truth in result.study.chosen_truths.values())
    return [
        TextTable(
            "Relative L2 distance from the truth over the body, %",
            *_grid(result, result.schemes, FIELDS, "held out"),
            f"{ALL}: {SCHEMES[ALL]}. Strain: of the solver's own law, Green-Lagrange for finite strain. "
            "Truth's law: the von Mises stress that the law of the truth gives for the solver's displacement "
            "gradient. vs fem: better or worse, by a bootstrap over folds and seeds; ≈: not told apart.",
        ),
        TextTable(
            f"Held-out error in {result.main_scheme}, mm; stress and force with every marker given, %",
            *_grid(result, [ALL], TRUTHS, held_out=result.main_scheme),
            f"Truths are solutions of {', '.join(simulations)}. von Mises: relative L2 distance over the "
            "body, at points that move with the walls. Force: along the stroke, against the truth's; ±: half "
            "of its interval; tangent.: that across the stroke. "
            f"Within: how often the truth lies in the interval of {LEVEL:.0%} that the solver states.",
        ),
    ]


def _grid(
    result: CrossvalResult,
    schemes: Sequence[str],
    columns: Mapping[str, tuple[str, Format]],
    named: str = "",
    held_out: str = "",
) -> tuple[list[str], list[list[str]]]:
    """Headings and rows: a row a solver and scheme, under the names of truth and layout if there are several.

    Args:
        result: The cross-validation.
        schemes: Of the rows.
        columns: Score and format by heading; a column without any text is left out.
        named: Heading of a column of schemes; empty for none.
        held_out: Scheme whose held-out error is another column; empty for none.
    """
    scores = result.scores
    known = dict(zip(scores.index, scores.to_dict("records"), strict=True))

    def text(key: tuple[str, ...], shown: Format) -> str:
        return shown(known[key]) if key in known else NONE

    rows: list[list[str]] = []
    for case, part in scores.groupby(CASE, sort=False):
        solvers = part.index.unique("solver")
        own = [
            [
                solver,
                *([scheme] if named else []),
                *([text((*case, solver, held_out, HELD_OUT), _small)] if held_out else []),
                *(text((*case, solver, scheme, score), shown) for score, shown in columns.values()),
            ]
            for scheme in schemes
            for solver in solvers
        ]
        if said := result.said(*case):
            rows.append([said, *[""] * (len(own[0]) - 1)])
        rows += own
    headings = ["solver", *([named] if named else []), *(["held\nout"] if held_out else []), *columns]
    used = [place for place in range(len(headings)) if {row[place] for row in rows} - {NONE, ""}]
    return [headings[place].rstrip(" ") for place in used], [[row[place] for place in used] for row in rows]

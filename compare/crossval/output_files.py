"""The output files of a cross-validation: numbers, tables, pictures and the report."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

from compare.crossval.answers import answers
from compare.crossval.charts import draw_fields, draw_held_out, draw_weight_sweeps
from compare.crossval.folds import ONE, SeedResults
from compare.crossval.result import Case, CrossvalResult
from compare.crossval.tables import grids, write_tables
from compare.figures import FORMATS
from compare.runtime.html import write_page
from compare.runtime.tables import Cell, write_csv
from geometry.atomic import write_json
from geometry.content_hash import file_digest
from geometry.figure import Figure

HELD_OUT, FIELDS, SWEEP = "held_out", "fields", "l_curve"
"""Names of the pictures, without the truth that follows if there are several."""


def write_results(
    out: Path,
    result: CrossvalResult,
    results: Mapping[Case, Mapping[str, SeedResults]],
    sweeps: Mapping[Case, Mapping[str, Sequence[float]]],
    provenance: Mapping[str, Any],
) -> None:
    """Write all files; `crossval.json` last, with the SHA-256 of the others."""
    write_tables(out, result, results)
    pictures = {
        truth: [
            drawn.save(
                out / f"{name}{'' if len(result.truths) == 1 else '-' + truth}.png",
                result.study.picture_formats,
            )
            for name, drawn in each
        ]
        for truth in result.truths
        for each in [_pictures(result, truth, sweeps)]
    }
    if sweeps:
        rows: list[dict[str, Cell]] = [
            case.cells | dict(zip(sweep, values, strict=True))
            for case, sweep in sweeps.items()
            for values in zip(*sweep.values(), strict=True)
        ]
        write_csv(out / "l_curve.csv", rows)
    kinds = ("png", *result.study.picture_formats)
    saved = {path.with_suffix(f".{kind}") for each in pictures.values() for path in each for kind in kinds}
    for name, kind in product((HELD_OUT, FIELDS, SWEEP), ("png", *FORMATS)):
        for path in {
            *out.glob(f"{name}.{kind}"),
            *out.glob(f"{name}-*.{kind}"),
        } - saved:  # of an earlier study
            path.unlink()
    said = answers(result)
    write_page(
        out / "report.html",
        "crossval.html.j2",
        result=result,
        answers=said,
        tables=grids(result),
        pictures=pictures,
    )
    written = [path for path in sorted(out.glob("*.*")) if path.suffix in (".csv", ".png", ".html")]
    write_json(
        out / "crossval.json",
        {
            **provenance,
            **result.content(),
            "answers": said,
            "files_sha256": {path.name: file_digest(path) for path in written},
        },
    )


def _pictures(
    result: CrossvalResult, truth: str, sweeps: Mapping[Case, Mapping[str, Sequence[float]]]
) -> Iterable[tuple[str, Figure]]:
    """The pictures of a truth by name."""
    by_layout = result.of_truth(truth)
    if ONE in result.schemes:
        errors = {
            layout: {label: scores[ONE].per_marker for label, scores in each.scores.items()}
            for layout, each in by_layout.items()
        }
        yield HELD_OUT, draw_held_out(errors=errors, label=result.study.label)
    if result.has_fields:
        scores = {layout: each.scores for layout, each in by_layout.items()}
        yield FIELDS, draw_fields(scores=scores, schemes=result.schemes)
    if swept := {case.layout: sweep for case, sweep in sweeps.items() if case.truth == truth}:
        yield SWEEP, draw_weight_sweeps(sweeps=swept)

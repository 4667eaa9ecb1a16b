"""The output files of a cross-validation: numbers, tables, pictures and the report."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from compare.crossval.answers import answers
from compare.crossval.charts import draw_fields, draw_held_out, draw_weight_sweeps
from compare.crossval.folds import ONE, SeedResults
from compare.crossval.result import CrossvalResult
from compare.crossval.tables import grids, write_tables
from compare.runtime.html import template_environment
from compare.runtime.tables import write_csv
from geometry.atomic import write_json, write_text
from geometry.content_hash import file_digest

HELD_OUT, FIELDS, SWEEP = "held_out.png", "fields.png", "l_curve.png"


def write_results(
    out: Path,
    result: CrossvalResult,
    results: Mapping[str, Mapping[str, SeedResults]],
    sweeps: Mapping[str, Mapping[str, Sequence[float]]],
    provenance: Mapping[str, Any],
) -> None:
    """Write all files; `crossval.json` last, with the SHA-256 of the others."""
    write_tables(out, result, results)
    pictures = []
    if ONE in result.schemes:
        errors = {
            layout: {label: scores[ONE].per_marker for label, scores in each.scores.items()}
            for layout, each in result.layouts.items()
        }
        simulated = result.study.measurements is None
        pictures.append(draw_held_out(errors=errors, simulated=simulated).save(out / HELD_OUT))
    if result.has_fields:
        scores = {layout: each.scores for layout, each in result.layouts.items()}
        pictures.append(draw_fields(scores=scores, schemes=result.schemes).save(out / FIELDS))
    if sweeps:
        rows = [
            {"layout": layout, **dict(zip(sweep, values, strict=True))}
            for layout, sweep in sweeps.items()
            for values in zip(*sweep.values(), strict=True)
        ]
        write_csv(out / "l_curve.csv", rows)
        pictures.append(draw_weight_sweeps(sweeps=sweeps).save(out / SWEEP))
    for name in {HELD_OUT, FIELDS, SWEEP} - {path.name for path in pictures}:  # of an earlier study with more
        (out / name).unlink(missing_ok=True)
    template = template_environment().get_template("crossval.html.j2")
    html = template.render(result=result, answers=answers(result), grids=grids(result), pictures=pictures)
    write_text(out / "report.html", html)
    written = [path for path in sorted(out.glob("*.*")) if path.suffix in (".csv", ".png", ".html")]
    write_json(
        out / "crossval.json",
        {
            **provenance,
            **result.content(),
            "answers": answers(result),
            "files_sha256": {path.name: file_digest(path) for path in written},
        },
    )

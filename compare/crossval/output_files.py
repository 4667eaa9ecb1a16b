"""The output files of a cross-validation: numbers, tables, pictures and the report."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

from compare.crossval.charts import draw_fields, draw_held_out, draw_weight_sweeps
from compare.crossval.folds import ONE, SeedResults
from compare.crossval.result import Case, CrossvalResult
from compare.crossval.tables import all_tables
from compare.crossval.verdicts import conclusions
from compare.figures import FORMATS
from compare.runtime.html import write_html
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
    write_csv(out / "held_out.csv", result.held_out_rows())
    if result.has_fields:
        write_csv(out / "fields.csv", result.field_rows())
    if result.study.chosen_truths:
        write_csv(out / "truths.csv", result.truth_rows())
    write_csv(out / "folds.csv", list(_fold_rows(results)))
    if sweeps:
        rows: list[dict[str, Cell]] = [
            case._asdict() | dict(zip(sweep, values, strict=True))
            for case, sweep in sweeps.items()
            for values in zip(*sweep.values(), strict=True)
        ]
        write_csv(out / "l_curve.csv", rows)
    pictures = _write_pictures(out, result, sweeps)
    answers = conclusions(result)
    write_html(
        out / "report.html",
        "crossval.html.j2",
        result=result,
        answers=answers,
        tables=all_tables(result),
        pictures=pictures,
    )
    written = [path for path in sorted(out.glob("*.*")) if path.suffix in (".csv", ".png", ".html")]
    hashes = {path.name: file_digest(path) for path in written}
    content = {**provenance, **result.content(), "answers": answers, "files_sha256": hashes}
    write_json(out / "crossval.json", content)


def _fold_rows(results: Mapping[Case, Mapping[str, SeedResults]]) -> Iterator[dict[str, Cell]]:
    """Every error of every fold."""
    for case, by_label in results.items():
        for label, seeds in by_label.items():
            for seed, found in ((seed, found) for seed, folds in enumerate(seeds) for found in folds):
                for marker, (u, v) in enumerate(found.errors):
                    yield case._asdict() | {
                        "solver": label,
                        "seed": seed,
                        "scheme": found.fold.scheme,
                        "fold": found.fold.name,
                        "marker": marker + 1,
                        "held_out": int(marker in found.held),
                        "error_u_mm": u,
                        "error_v_mm": v,
                    }


def _write_pictures(
    out: Path, result: CrossvalResult, sweeps: Mapping[Case, Mapping[str, Sequence[float]]]
) -> dict[str, list[Path]]:
    """Write the pictures of each truth, and remove pictures of an earlier study."""
    formats = result.study.picture_formats
    pictures = {
        truth: [
            drawn.save(out / f"{name}{'' if len(result.truths) == 1 else '-' + truth}.png", formats)
            for name, drawn in _pictures(result, truth, sweeps)
        ]
        for truth in result.truths
    }
    kinds = ("png", *formats)
    saved = {path.with_suffix(f".{kind}") for each in pictures.values() for path in each for kind in kinds}
    for name, kind in product((HELD_OUT, FIELDS, SWEEP), ("png", *FORMATS)):
        for path in {*out.glob(f"{name}.{kind}"), *out.glob(f"{name}-*.{kind}")} - saved:
            path.unlink()
    return pictures


def _pictures(
    result: CrossvalResult, truth: str, sweeps: Mapping[Case, Mapping[str, Sequence[float]]]
) -> Iterator[tuple[str, Figure]]:
    """The pictures of a truth by name."""
    by_layout = result.of_truth(truth)
    if ONE in result.schemes:
        errors = {
            layout: {label: scores[ONE].per_marker for label, scores in each.scores.items()}
            for layout, each in by_layout.items()
        }
        yield HELD_OUT, draw_held_out(errors, result.study.label)
    if result.has_fields:
        scores = {layout: each.scores for layout, each in by_layout.items()}
        yield FIELDS, draw_fields(scores, result.schemes)
    if swept := {case.layout: sweep for case, sweep in sweeps.items() if case.truth == truth}:
        yield SWEEP, draw_weight_sweeps(swept)

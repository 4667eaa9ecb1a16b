"""The output files of a cross-validation: numbers, tables, pictures and the report."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from compare.crossval.charts import draw_fields, draw_held_out, draw_weight_sweep
from compare.crossval.folds import ALL, ONE, SeedResults
from compare.crossval.result import CrossvalResult
from compare.crossval.scores import FIELD_NAMES
from compare.crossval.tables import grids, write_tables
from compare.evaluation.number_format import percent
from compare.runtime.html import template_environment
from compare.runtime.tables import write_csv
from geometry.atomic import write_json, write_text
from geometry.content_hash import file_digest
from solvers.assimilation.misfit import assimilates

HELD_OUT, FIELDS, SWEEP = "held_out.png", "fields.png", "l_curve.png"


def write_results(
    out: Path,
    result: CrossvalResult,
    results: Mapping[str, SeedResults],
    sweep: Mapping[str, Sequence[float]],
    provenance: Mapping[str, Any],
) -> None:
    """Write all files; `crossval.json` last, with the SHA-256 of the others."""
    write_tables(out, result, results)
    pictures = []
    if ONE in result.schemes:
        errors = {label: each[ONE].per_marker for label, each in result.scores.items()}
        simulated = result.study.measurements is None
        pictures.append(draw_held_out(errors=errors, simulated=simulated).save(out / HELD_OUT))
    if result.has_fields:
        pictures.append(draw_fields(scores=result.scores, schemes=result.schemes).save(out / FIELDS))
    if sweep:
        rows = [dict(zip(sweep, values, strict=True)) for values in zip(*sweep.values(), strict=True)]
        write_csv(out / "l_curve.csv", rows)
        pictures.append(draw_weight_sweep(sweep=sweep).save(out / SWEEP))
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


def answers(result: CrossvalResult) -> Mapping[str, list[str]]:
    """Sentences on the solvers that assimilate, by question; questions without an answer are left out."""
    given = [
        variant.label
        for variant in result.study.variants
        if variant.label in result.scores and assimilates(variant.make(0))
    ]
    found = {
        "Are held-out markers better predicted with the others than without?": _predictions(result, given),
        "Is the stress better after assimilation?": _stresses(result, given),
    }
    return {question: sentences for question, sentences in found.items() if sentences}


def _predictions(result: CrossvalResult, given: list[str]) -> list[str]:
    """Verdicts on each solver's held-out error against every baseline, grouped by verdict."""
    sentences = []
    for label in given:
        for baseline, schemes in result.differences[label].items():
            verdicts: dict[str, list[str]] = {}
            for scheme, found in schemes.items():
                if "mae_sum" in found:
                    verdicts.setdefault(found["mae_sum"].verdict, []).append(scheme)
            if verdicts:
                said = "; ".join(f"{verdict} in {', '.join(names)}" for verdict, names in verdicts.items())
                sentences.append(f"{label} against {baseline}: {said}.")
    return sentences


def _stresses(result: CrossvalResult, given: list[str]) -> list[str]:
    """Distances of the fields from the truth, all markers given, beside those of `fem`."""
    if not result.has_fields or "fem" not in result.scores:
        return []
    plain = result.scores["fem"][ALL].fields
    sentences = []
    for label in given:
        own = result.scores[label][ALL].fields
        parts = []
        for name, words in FIELD_NAMES.items():
            difference = result.difference(label, "fem", ALL, name)
            said = difference.verdict if difference else "not told apart"
            parts.append(f"{words} {percent(plain[name].mean, 2)} to {percent(own[name].mean, 2)} ({said})")
        sentences.append(f"{label}, given every marker, against fem: {', '.join(parts)} away from the truth.")
    return sentences

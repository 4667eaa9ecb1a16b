"""What a cross-validation writes: numbers, tables, pictures and the report."""

from base64 import b64encode
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from compare.crossval.answers import answers
from compare.crossval.charts import draw_curve, draw_fields, draw_held_out
from compare.crossval.fold_result import FoldResult
from compare.crossval.result import CrossvalResult
from compare.crossval.tables import grids, per_marker, write_tables
from compare.runtime.csv_files import write_csv
from compare.runtime.provenance import file_digest
from geometry.atomic import atomic_path, write_json

HELD_OUT, FIELDS, CURVE = "held_out.png", "fields.png", "l_curve.png"


def write_results(
    out: Path,
    result: CrossvalResult,
    outcomes: Mapping[str, Sequence[Sequence[FoldResult]]],
    curve: Mapping[str, Sequence[float]],
    provenance: Mapping[str, Any],
) -> None:
    """Write everything; `crossval.json` last, with the SHA-256 of the other files."""
    write_tables(out, result, outcomes)
    pictures = []
    if marker_errors := per_marker(result):
        draw_held_out(out / HELD_OUT, errors=marker_errors, simulated=result.study.measurements is None)
        pictures.append(HELD_OUT)
    if draw_fields(out / FIELDS, scores=result.scores, schemes=result.schemes):
        pictures.append(FIELDS)
    if curve:
        rows = [dict(zip(curve, values, strict=True)) for values in zip(*curve.values(), strict=True)]
        write_csv(out / "l_curve.csv", rows)
        draw_curve(out / CURVE, curve=curve)
        pictures.append(CURVE)
    for name in {HELD_OUT, FIELDS, CURVE} - set(pictures):  # of an earlier study with more
        (out / name).unlink(missing_ok=True)
    _write_report(out / "report.html", result, [out / name for name in pictures])
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


def _write_report(path: Path, result: CrossvalResult, pictures: Sequence[Path]) -> None:
    environment = Environment(
        loader=PackageLoader("compare"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    text = environment.get_template("crossval.html.j2").render(
        design=result.study.design.name,
        source=result.source,
        seeds=result.study.seeds,
        answers=answers(result),
        grids=grids(result),
        failed=result.failed,
        pictures=[(file.stem, b64encode(file.read_bytes()).decode()) for file in pictures],
    )
    with atomic_path(path) as partial:
        partial.write_text(text, encoding="utf-8")

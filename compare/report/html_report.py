"""The report: one HTML file that holds its pictures and needs nothing else."""

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Template

from compare.evaluation.certification import REGION_RADIUS
from compare.evaluation.comparison import Comparison, unsupported_remarks
from compare.evaluation.evaluation import Evaluation
from compare.evaluation.metrics import force_error, indistinct, reference_differences, truth_differences
from compare.figures import Picture
from compare.figures.fields import QUANTITIES
from compare.report import text
from compare.report.field_viewer import viewer
from compare.report.metrics_json import metrics
from compare.report.summary import answers
from compare.report.tables import millimetres, printed_rows, seconds, table_one
from compare.runtime.html import picture_urls, template_environment
from compare.runtime.tables import distance, number, percent
from geometry.atomic import write_text


def write_report(
    path: Path,
    comparison: Comparison,
    pictures: Sequence[Picture],
    provenance: Mapping[str, object],
    numbers: Mapping[str, Any] | None = None,
) -> None:
    """Write the report as one HTML file, atomically; arguments as for `report_html`."""
    write_text(path, report_html(comparison, pictures, provenance, numbers))


def report_html(
    comparison: Comparison,
    pictures: Sequence[Picture],
    provenance: Mapping[str, object],
    numbers: Mapping[str, Any] | None = None,
) -> str:
    """The report as HTML text.

    `provenance` are facts of the run (seed, versions, hashes, times); a mapping in it becomes a group.
    `numbers` are the comparison's `metrics`, where they are known already.
    """
    numbers = metrics(comparison) if numbers is None else numbers
    design = comparison.design
    certificates = [each.certificate for each in comparison.evaluations if each.certificate]
    fields = {quantity.name for quantity in QUANTITIES}
    return _template().render(
        comparison=comparison,
        observations=comparison.observations,
        answers=answers(numbers, unsupported=comparison.unsupported, failed=comparison.failed),
        own=comparison.reference.uncertainty,
        table_one=table_one(comparison),
        printed=printed_rows(design),
        entries=[_entry(evaluation, comparison) for evaluation in comparison.evaluations],
        unsupported=[*unsupported_remarks(comparison.unsupported), *comparison.failed.values()],
        has_symbols=any(symbol for _, symbol, _ in design.facts()),
        regions={name for certificate in certificates for name in certificate.regions},
        near=REGION_RADIUS,
        text=text,
        viewer=viewer(comparison),
        urls=picture_urls([picture.path for picture in pictures]),
        pictures=[picture for picture in pictures if picture.path.stem not in fields],
        stills=[picture for picture in pictures if picture.path.stem in fields],
        provenance=provenance,
    )


@cache  # compiling takes a fifth of a second
def _template() -> Template:
    environment = template_environment()
    filters = (millimetres, number, distance, percent)
    environment.filters |= {each.__name__: each for each in filters}
    return environment.get_template("report.html.j2")


def _entry(evaluation: Evaluation, comparison: Comparison) -> dict[str, object]:
    """One solver's part of the tables."""
    reference, truth = comparison.reference, comparison.truth
    differences = reference_differences(evaluation, reference)
    return {
        "label": evaluation.label,
        "is_reference": evaluation is reference,
        "evaluation": evaluation,
        "to_truth": None if truth is None else truth_differences(evaluation, truth),
        "force_to_truth": None if truth is None else force_error(evaluation, truth),
        "differences": differences,
        "indistinct": text.indistinct_sentence(
            evaluation.label,
            reference.label,
            [] if evaluation is reference else indistinct(differences, reference.uncertainty),
        ),
        "reaction": text.without_rounding(evaluation.reaction),
        "seconds": seconds(evaluation),
        "certificate": evaluation.certificate,
        "certificate_sentences": text.certificate_sentences(evaluation, comparison.load.kind),
    }

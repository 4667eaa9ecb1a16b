"""The report: one HTML file that holds its pictures and needs nothing else."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from compare.evaluation.certificate import Certificate
from compare.evaluation.differences import ReferenceDifferences
from compare.evaluation.evaluation import Evaluation
from compare.evaluation.labels import solver_label
from compare.evaluation.metrics import TruthDifferences, reference_differences, truth_differences
from compare.evaluation.number_format import distance, number, percent
from compare.evaluation.regions import NEAR
from compare.evaluation.uncertainty import indistinct
from compare.figures import Figure
from compare.report import text
from compare.report.certificate_text import certificate_sentences
from compare.report.table_one import PRINTED, millimetres, table_one
from compare.report.tables import seconds
from compare.report.truth_text import truth_sentences
from compare.runtime.html import template_environment
from geometry.atomic import atomic_path
from geometry.finger.parameters import Parameters
from geometry.mesh.triangle_mesh import TriangleMesh
from geometry.observations import Observations
from solvers.adaptation import Adaptation
from solvers.problem import Load, Material


@dataclass(frozen=True, eq=False)
class ReportContent:
    """What a report tells.

    Attributes:
        design: The finger.
        material: The elastic law and its constants.
        load: What moved the finger.
        mesh: The mesh that the solvers shared.
        observations: What the markers did.
        evaluations: One for each solver, in the order of the tables.
        reference: One of the evaluations.
        figures: Pictures in the order in which they appear.
        provenance: What to state of the run (seed, versions, hashes, times); a mapping becomes a group.
        adaptation: How the mesh was refined, if that was asked for.
        left_out: Which solvers cannot do the job, and why.
        truth: The fields of the virtual experiment; None where markers were measured.
    """

    design: Parameters
    material: Material
    load: Load
    mesh: TriangleMesh
    observations: Observations
    evaluations: Sequence[Evaluation]
    reference: Evaluation
    figures: Sequence[Figure]
    provenance: Mapping[str, object]
    adaptation: Adaptation | None = None
    left_out: Sequence[str] = ()
    truth: Evaluation | None = None


@dataclass(frozen=True, eq=False)
class SolverEntry:
    """One solver's line in the tables."""

    label: str
    is_reference: bool
    evaluation: Evaluation
    to_truth: TruthDifferences | None
    differences: ReferenceDifferences
    indistinct: str
    reaction: tuple[float, float]
    seconds: str
    certificate: Certificate | None
    certificate_sentences: str


def write_report(path: Path, content: ReportContent) -> None:
    """Write the report as one HTML file, atomically."""
    html = render(content)
    with atomic_path(path) as partial:
        partial.write_text(html, encoding="utf-8")


def render(content: ReportContent) -> str:
    """The report as HTML text."""
    environment = template_environment()
    environment.filters |= {
        "millimetres": millimetres,
        "number": number,
        "distance": distance,
        "percent": percent,
        "sentence": text.sentence,
        "stat": text.stat,
        "symbol": text.symbol,
    }
    return environment.get_template("report.html.j2").render(
        content=content,
        observations=content.observations,
        reference=content.reference,
        reference_label=solver_label(content.reference),
        own=content.reference.uncertainty,
        own_error=text.own_error_sentence(solver_label(content.reference), content.reference),
        beside=text.beside,
        table_one=table_one(content.evaluations, content.observations),
        printed=PRINTED,
        truth_sentences=truth_sentences(content.evaluations, content.reference, content.truth),
        entries=[_entry(evaluation, content) for evaluation in content.evaluations],
        design_rows=text.design_rows(content.design),
        paper_rows=[(symbol, value) for _, symbol, value in text.design_rows(content.design) if symbol],
        material_rows=text.material_rows(
            content.material, {solver_label(evaluation): evaluation.law for evaluation in content.evaluations}
        ),
        near=NEAR,
        load_sentence=text.load_sentence(content.load, content.design),
        source=text.source_sentence(content.observations),
        provenance=text.grouped(content.provenance),
    )


def _entry(evaluation: Evaluation, content: ReportContent) -> SolverEntry:
    differences = reference_differences(evaluation, content.reference)
    return SolverEntry(
        label=solver_label(evaluation),
        is_reference=evaluation is content.reference,
        evaluation=evaluation,
        to_truth=None if content.truth is None else truth_differences(evaluation, content.truth),
        differences=differences,
        indistinct=text.indistinct_sentence(
            solver_label(evaluation),
            solver_label(content.reference),
            [] if evaluation is content.reference else indistinct(differences, content.reference.uncertainty),
        ),
        reaction=text.without_rounding(evaluation.reaction),
        seconds=seconds(evaluation),
        certificate=evaluation.certificate,
        certificate_sentences=certificate_sentences(evaluation),
    )

"""The report: one HTML file that holds its pictures and needs nothing else."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from compare.atomic import atomic_path
from compare.evaluation import Evaluation
from compare.figures import Figure
from compare.figures.labels import solver_label
from compare.metrics import MarkerErrors, ReferenceDifferences, marker_errors, reference_differences
from compare.tables import seconds
from geometry.mesh import TriangleMesh
from geometry.observations import Observations
from geometry.parameters import Parameters, fact
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
        provenance: What to state of the run (seed, versions, hashes, times); a value that is a mapping becomes a group.
        assimilating: Names of the solvers that used the markers, so that their errors there are training errors.
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
    assimilating: frozenset[str] = field(default_factory=frozenset)


@dataclass(frozen=True, eq=False)
class SolverEntry:
    """One solver's line in the tables."""

    label: str
    assimilates: bool
    is_reference: bool
    evaluation: Evaluation
    errors: MarkerErrors
    differences: ReferenceDifferences
    seconds: str


def write_report(path: Path, content: ReportContent) -> None:
    """Write the report as one HTML file, atomically."""
    html = render(content)
    with atomic_path(path) as partial:
        partial.write_text(html, encoding="utf-8")


def render(content: ReportContent) -> str:
    """The report as HTML text."""
    environment = Environment(
        loader=PackageLoader("compare"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"number": number, "percent": percent, "png": embedded}
    return environment.get_template("report.html.j2").render(
        content=content,
        observations=content.observations,
        reference=content.reference,
        reference_label=solver_label(content.reference),
        entries=[_entry(evaluation, content) for evaluation in content.evaluations],
        design_rows=design_rows(content.design),
        material_rows=material_rows(content.material),
        load_sentence=load_sentence(content.load, content.design),
        provenance=grouped(content.provenance),
    )


def _entry(evaluation: Evaluation, content: ReportContent) -> SolverEntry:
    return SolverEntry(
        label=solver_label(evaluation),
        assimilates=evaluation.solver in content.assimilating,
        is_reference=evaluation is content.reference,
        evaluation=evaluation,
        errors=marker_errors(evaluation, content.observations),
        differences=reference_differences(evaluation, content.reference),
        seconds=seconds(evaluation),
    )


def design_rows(design: Parameters) -> list[tuple[str, str, str]]:
    """The design's parameters as meaning, the paper's symbol, and value with unit."""
    rows = []
    for name, described in type(design).model_fields.items():
        value = getattr(design, name)
        if name == "name" or value is None:
            continue
        meaning = (described.description or name).split(" [")[0]
        unit = {"deg": "°"}.get(fact(name, "unit"), f" {fact(name, 'unit')}")
        text = f"{value:g}{unit}".rstrip() if isinstance(value, int | float) else str(value)
        rows.append((meaning, str(fact(name, "symbol")), text))
    return rows


def material_rows(material: Material) -> list[tuple[str, str]]:
    """The material in words."""
    law = {"linear": "linear elastic (Hooke)", "neo-hookean": "neo-Hookean, finite strain"}[material.law]
    return [
        ("Law", f"{law}, plane {material.plane}"),
        ("Young's modulus", f"{material.young:g} MPa"),
        ("Poisson's ratio", f"{material.poisson:g}"),
    ]


def load_sentence(load: Load, design: Parameters) -> str:
    """What the indenter does, in a sentence."""
    where = {
        "mean": f"The weighted mean displacement over the {design.contact_width:g} mm wide contact is prescribed",
        "point": "The displacement of one point, the contact's middle, is prescribed",
        "patch": f"Every point of the {design.contact_width:g} mm wide contact has the prescribed displacement",
    }[load.kind]
    parts = [
        f"{name} is free" if value is None else f"{name} = {value:g} mm"
        for name, value in zip("uv", load.displacement, strict=True)
    ]
    return f"{where}: {', '.join(parts)}, about x = {design.contact_abscissa:g} mm on the front face (load “{load.kind}”)."


def grouped(provenance: Mapping[str, object]) -> list[tuple[str, list[tuple[str, str]]]]:
    """Provenance as groups of lines; what is not in a mapping comes first, in a group without a title."""
    loose = [(key, str(value)) for key, value in provenance.items() if not isinstance(value, Mapping)]
    groups = [("", loose)] if loose else []
    for key, value in provenance.items():
        if isinstance(value, Mapping):
            groups.append((key, [(str(inner), str(entry)) for inner, entry in value.items()]))
    return groups


def embedded(path: Path) -> str:
    """A PNG file as a data URL."""
    return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode("ascii")


def number(value: float, digits: int = 4) -> str:
    """A number with so many significant digits, with a typographic minus."""
    return f"{value:.{digits}g}".replace("-", "−")


def percent(value: float) -> str:
    """A share as a percentage with three significant digits."""
    return f"{100 * value:.3g} %".replace("-", "−")

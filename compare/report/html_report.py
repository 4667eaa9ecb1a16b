"""The report: one HTML file that holds its pictures and a viewer of the fields, and needs nothing else.

Numbers have 16 bits: the range of a field, or of its difference, in 65,535 steps.
"""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
from jinja2 import Template

from pinnray.comparison.evaluation.comparison import TRUTH, Results
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.figures import Picture
from pinnray.comparison.figures.body import symmetric
from pinnray.comparison.figures.fields import VIEWED, field_scale, triangle_values
from pinnray.comparison.figures.overlay import contact_motion
from pinnray.comparison.report import text
from pinnray.comparison.report.numbers import seconds, share
from pinnray.comparison.report.page_body import packed_body
from pinnray.comparison.report.summary import answers
from pinnray.comparison.report.tables import printed_rows, table_one
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.html import Packed, picture_urls, template_environment
from pinnray.runtime.machine import program_version
from pinnray.runtime.tables import distance, number

BUDGET = 6_000_000
"""Bytes of packed fields: with a finer mesh or more solvers there are fewer quantities to choose from."""
SPARED = ("strain_xx", "strain_yy", "strain_xy")
"""Pictures that are files only: the viewer has these fields too."""


def viewer(comparison: Results) -> dict[str, Any] | None:
    """Manifest and packed arrays of the viewer; None where there is no field to show.

    There are no solvers whose field is not finite, and no quantities beyond the `BUDGET`.
    """
    mesh, reference = comparison.mesh, comparison.reference
    shown = [each for each in comparison.shown_fields if each.finite]
    size = 2 * len(shown) * len(mesh.triangles)
    quantities = VIEWED[: BUDGET // size if size else 0]
    if not quantities or not reference.finite:
        return None
    packed = Packed()
    fields = {each.solver: np.array([triangle_values(of, each) for of in quantities]) for each in shown}
    manifest = {
        **packed_body(mesh, packed),
        "reference": reference.label,
        "quantities": [
            {
                "name": quantity.name,
                "title": quantity.title,
                "unit": quantity.unit,
                "low": (scale := field_scale(quantity, mesh, reference)).low,
                "high": scale.high,
                "signed": quantity.signed,
            }
            for quantity in quantities
        ],
        "solvers": [_solver(each, comparison, fields, packed) for each in shown],
        "name": comparison.design.name,
    }
    return {"manifest": manifest, "data": packed.text()}


def _solver(
    evaluation: Evaluation, comparison: Results, fields: Mapping[str, FloatArray], packed: Packed
) -> dict[str, Any]:
    """A solver's fields, shape (k, t); of one that is not the reference, their differences from it."""
    mesh, name = comparison.mesh, comparison.reference.solver
    is_reference, own = evaluation is comparison.reference, fields[evaluation.solver]
    against = {"reference": fields[name]} | ({"truth": fields[TRUTH]} if TRUTH in fields else {})
    start, end = contact_motion(comparison, evaluation)
    fractions, states, path = _load_path(evaluation)
    return {
        "label": "truth (simulated)" if evaluation.solver == TRUTH else evaluation.label,
        "isReference": is_reference,
        "isTruth": evaluation.solver == TRUTH,
        "scales": {
            base: [symmetric(difference, mesh.areas).high for difference in own - others]
            for base, others in against.items()
        },
        "contact": [start.tolist(), end.tolist()],
        "markers": _markers(evaluation, comparison),
        "observed": comparison.observed(evaluation).tolist(),
        "fields": [packed.add_steps(each) for each in (own if is_reference else own - fields[name])],
        "fractions": fractions,
        "states": packed.add_steps(states),
        "path": path,
    }


def _markers(evaluation: Evaluation, comparison: Results) -> dict[str, Any]:
    """Markers as the finger has them: at rest, displaced at the full load, and the nearest node of each."""
    mesh, points = comparison.mesh, comparison.observations.points
    nearest = [int(np.linalg.norm(mesh.points - point, axis=1).argmin()) for point in points]
    moved = evaluation.marker_displacement
    return {"points": points.tolist(), "displacements": moved.tolist(), "nodes": nearest}


def _load_path(evaluation: Evaluation) -> tuple[list[float], FloatArray, str]:
    """Fractions of the load, the nodes' displacements there, shape (k, n, 2), mm, and a word on them."""
    path, fractions = evaluation.path, evaluation.history.get("load_fraction")
    if path is not None and fractions is not None and len(path) == len(fractions) > 1:
        chosen = np.unique(np.linspace(0, len(path) - 1, min(16, len(path))).round().astype(int))
        word = f"load path of {len(path) - 1} equilibria that the solver found"
        return np.asarray(fractions)[chosen].tolist(), path[chosen], word
    word = (
        "scaled in proportion to the load, as the linear law implies"
        if evaluation.law == "linear"
        else "end state scaled for the eye: this solver records no load path"
    )
    end = evaluation.node_displacement
    return [0.0, 1.0], np.stack([np.zeros_like(end), end]), word


def report_html(comparison: Results, pictures: Sequence[Picture], provenance: Mapping[str, object]) -> str:
    """The report as HTML text.

    `provenance` are facts of the run (seed, versions, hashes, times); a mapping in it becomes a group.
    """
    design, scores = comparison.design, comparison.scores
    return _template().render(
        comparison=comparison,
        observations=comparison.observations,
        scores=scores,
        answers=answers(scores),
        own=scores[scores.reference].to_reference.reference_uncertainty,
        table_one=table_one(scores),
        printed=printed_rows(design),
        missing=[said for each in comparison.evaluations if (said := text.missed_energy(each))],
        has_symbols=any(symbol for _, symbol, _ in design.facts()),
        text=text,
        viewer=viewer(comparison),
        urls=picture_urls([picture.path for picture in pictures]),
        pictures=[picture for picture in pictures if picture.path.stem not in SPARED],
        provenance=provenance,
        version=program_version(),
    )


@cache  # compiling takes a fifth of a second
def _template() -> Template:
    environment = template_environment("pinnray.comparison")
    filters = (number, distance, share, seconds)
    environment.filters |= {each.__name__: each for each in filters}
    return environment.get_template("report.html.j2")

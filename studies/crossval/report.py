"""The output files of a cross-validation: tables and the page."""

from collections.abc import Mapping
from typing import Any

from pinnray.runtime.atomic import write_json
from pinnray.runtime.content_hash import file_digest
from pinnray.studies.crossval.result import CrossvalResult
from pinnray.studies.crossval.tables import all_tables
from pinnray.studies.sweep.page import write_page
from pinnray.studies.sweep.tables import write_frame


def write_results(result: CrossvalResult, provenance: Mapping[str, Any]) -> None:
    """Write all files; `crossval.json` last, with the SHA-256 of the others."""
    out = result.study.out
    files = [
        *write_frame(result.samples, out / "samples"),
        *write_frame(result.scores.reset_index(), out / "scores"),
    ]
    name = result.study.design.name
    pages = write_page(
        out / "report.html",
        f"Cross-validation of {name}",
        [
            "Errors of the solvers at markers, loads and fields that they were not given. The markers' "
            f"displacements are {'; '.join(dict.fromkeys(result.sources.values()))}. Seeds: "
            f"{result.study.seeds}.",
            *(f"{name} has no score: {message}" for name, message in result.failed.items()),
            *(f"Warning: {remark}" for remark in result.remarks),
        ],
        all_tables(result),
        {},
        f"{', '.join(path.name for path in files)}.",
    )
    content = {
        **provenance,
        "contacts": {
            name: {
                "true_force_N_mm": truth.force,
                "true_tangential_force_N_mm": truth.tangential,
                "true_position_mm": truth.position,
            }
            for name, truth in result.truths.items()
        },
        "failed": dict(result.failed),
        "remarks": result.remarks,
        "files_sha256": {path.name: file_digest(path) for path in (*files, *pages)},
    }
    write_json(out / "crossval.json", content)

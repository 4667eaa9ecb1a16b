"""What a cross-validation is asked for."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from compare.crossval.fold_results import SolverVariant
from compare.runtime.provenance import package_versions, sources_digest
from geometry.errors import UserError
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from geometry.observations import Observations
from solvers.problem import Load, Material
from solvers.solver import check_load, with_law


@dataclass(frozen=True)
class Study:
    """What to cross-validate, and where to write.

    Attributes:
        design: The finger.
        mesh: Element sizes of the mesh that solvers share.
        material: The elastic constants; each solver takes the law that it has.
        load: What moves the finger.
        entries: The solvers.
        schemes: Keys of `SCHEMES`.
        seeds: How often noise is drawn, and random numbers of solvers.
        noise: Standard deviation of a simulated marker's displacement, mm.
        measurements: CSV file of marker displacements; None for the virtual experiment.
        out: Output folder; what an earlier study with the same settings finished there is taken over.
        processes: How many solvers are judged at a time.
        threads: Threads of each.
    """

    design: Design
    mesh: MeshSettings
    material: Material
    load: Load
    entries: Sequence[SolverVariant]
    schemes: Sequence[str]
    seeds: int
    noise: float
    measurements: Path | None
    out: Path
    processes: int
    threads: int


def check_study(study: Study) -> None:
    """Refuse what cannot be done before anything is computed."""
    labels = [entry.label for entry in study.entries]
    if len(set(labels)) < len(labels):
        raise UserError(f"a solver is named twice: {', '.join(labels)}")
    for entry in study.entries:
        solver = entry.make(0)
        check_load(solver, study.load)
        with_law(study.material, solver)
    if study.measurements is None and study.load.displacement[1] is None:
        raise UserError("the virtual experiment presses on the finger: prescribe v")


def seen_markers(observations: Observations) -> Observations:
    """Only the markers that were seen, of which there must be some to hold out and some to give."""
    seen = observations.visible
    if (count := int(seen.sum())) < 3:
        raise UserError(f"cross-validation needs 3 markers that were seen, not {count}")
    order = np.flatnonzero(seen)[observations.points[seen, 0].argsort(kind="stable")]
    return replace(
        observations,
        points=observations.points[order],
        displacements=observations.displacements[order],
        standard_deviations=observations.standard_deviations[order],
        visible=seen[order],
    )


def definition_of(study: Study, given: Observations | None) -> dict[str, Any]:
    """Everything that what is kept depends on, but for the solvers' settings, which are kept with it."""
    measured = given and [
        values.tolist() for values in (given.points, given.displacements, given.standard_deviations)
    ]
    content = {
        "schema": 1,
        "design": study.design.model_dump(),
        "mesh": study.mesh.model_dump(),
        "material": study.material.model_dump(),
        "load": study.load.model_dump(mode="json"),
        "noise_mm": None if given else study.noise,
        "measured": measured,
        "versions": package_versions(),
        "program_sha256": sources_digest(
            [
                "compare.crossval.fold_results",
                "compare.crossval.folds",
                "compare.crossval.true_fields",
                "geometry",
                "solvers",
            ]
        ),
    }
    return dict(json.loads(json.dumps(content)))

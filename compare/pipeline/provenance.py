"""The record of a comparison, for its `run.json` and report."""

from pathlib import Path
from typing import Any

from compare.camera.film import Film
from compare.evaluation.comparison import Comparison
from compare.pipeline.job import Job
from compare.runtime.provenance import package_versions
from compare.runtime.stages import Stages
from geometry.content_hash import file_digest
from solvers.problem import Problem


def provenance(folder: Path, job: Job, comparison: Comparison, stages: Stages) -> dict[str, Any]:
    """Times, and what the numbers depend on: hashes, settings, seeds, devices, versions, machine."""
    adaptation, settings = comparison.adaptation, comparison.settings
    return {
        **stages.record(),
        "options": dict(job.options),
        "design_sha256": job.design.digest,
        "mesh_sha256": comparison.mesh.digest,
        "problem_sha256": Problem(comparison.mesh, job.material, job.load).digest,
        "mesh": job.mesh.model_dump(),
        "adapt": adaptation and {"tolerance_mm": adaptation.tolerance, "end": adaptation.message},
        "material": job.material.model_dump(),
        "load": job.load.model_dump(),
        "measurements_sha256": file_digest(folder / "observations.csv"),
        "film": job.measurements.provenance() if isinstance(job.measurements, Film) else None,
        "solvers": settings,
        "left_out": comparison.unsupported,
        "failed": comparison.failed,
        "seed": {name: own["seed"] for name, own in settings.items() if "seed" in own},
        "device": {each.solver: each.stats.get("device", "cpu") for each in comparison.evaluations},
        "versions": package_versions(),
    }

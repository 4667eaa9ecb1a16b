"""Everything that the result of a job on a finger depends on."""

from typing import Any

from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.content_hash import sources_digest
from pinnray.runtime.machine import package_versions
from pinnray.solvers.problem import Load, Material


def job_definition(
    design: Finger, mesh: MeshSettings | None, material: Material, load: Load, module: str
) -> dict[str, Any]:
    """Inputs, versions and sources of a job whose result the module of this name makes."""
    return {
        "schema": 1,
        "design": design.definition(),
        "mesh": mesh and mesh.model_dump(),
        "material": material.model_dump(),
        "load": load.model_dump(mode="json"),
        "versions": package_versions(),
        "program_sha256": sources_digest(module),
    }

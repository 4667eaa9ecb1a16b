"""A folder that keeps the finished parts of a long job, so that the same job can go on from them."""

import json
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from pydantic_core import to_jsonable_python

from compare.runtime.output_folder import check_links
from compare.runtime.provenance import package_versions
from geometry.atomic import is_partial
from geometry.content_hash import sources_digest
from geometry.errors import UserError
from geometry.finger.finger import Finger
from geometry.mesh.settings import MeshSettings
from solvers.problem import Load, Material


def job_definition(
    design: Finger, mesh: MeshSettings, material: Material, load: Load, module: str
) -> dict[str, Any]:
    """Everything that the result of a job on a finger depends on, if the module of this name makes it."""
    return {
        "schema": 1,
        "design": design.definition(),
        "mesh": mesh.model_dump(),
        "material": material.model_dump(),
        "load": load.model_dump(mode="json"),
        "versions": package_versions(),
        "program_sha256": sources_digest(module),
    }


def check_resumable_folder(
    file: Path, definition: Mapping[str, Any], *, job: str, free: Collection[str] = ()
) -> None:
    """Refuse a folder that holds a job with another definition, or something else.

    Args:
        file: The definition of the job in the folder, if there is one.
        definition: The definition of this job.
        job: The kind of job, such as "grid search".
        free: Entries that may differ, such as `study.samples`.
    """
    out = file.parent
    if out.exists() and not out.is_dir():
        raise UserError(f"{out} is a file; name an output folder")
    if not out.exists() or all(is_partial(path) for path in out.iterdir()):
        return
    check_links(out)
    try:
        before = _flat(json.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError):
        raise UserError(f"{out} holds files that are not of a {job}; name another output folder") from None
    now = _flat(to_jsonable_python(definition))
    names = [name for name in before | now if name not in free and before.get(name) != now.get(name)]
    if names:
        raise UserError(
            f"{out} holds a {job} with other settings ({', '.join(names)}); "
            "name another output folder, or remove that one"
        )


def _flat(content: Mapping[str, Any]) -> dict[str, Any]:
    """The entries, those of inner dictionaries as `key.name`."""
    entries: dict[str, Any] = {}
    for key, value in content.items():
        inner = value if isinstance(value, dict) else {}
        entries |= {f"{key}.{name}": each for name, each in inner.items()} or {key: value}
    return entries

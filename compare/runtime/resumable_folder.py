"""A folder that keeps what is finished of a long job, for the same job to go on from."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from geometry.errors import UserError


def check_resumable_folder(file: Path, definition: Mapping[str, Any], *, job: str) -> None:
    """Refuse a folder that holds another job of the kind, or something else.

    Args:
        file: In the folder, with the definition of the job that wrote there.
        definition: Of this job: all that what is kept depends on.
        job: The kind, such as "search".
    """
    out = file.parent
    if out.exists() and not out.is_dir():
        raise UserError(f"{out} is a file; name a folder with --out")
    if not out.exists() or not any(out.iterdir()):
        return
    try:
        before = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise UserError(
            f"{out} holds files that are not of a {job}; name another folder with --out"
        ) from None
    if differing := _differing(before, definition):
        raise UserError(
            f"{out} holds a {job} with other settings ({', '.join(differing)}); "
            "name another folder with --out, or remove that one"
        )


def _differing(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Names of the entries that differ."""
    flat_before, flat_now = _flat(before), _flat(now)
    return [name for name in {**flat_before, **flat_now} if flat_before.get(name) != flat_now.get(name)]


def _flat(content: Mapping[str, Any]) -> dict[str, Any]:
    entries: dict[str, Any] = {}
    for key, value in content.items():
        entries |= (
            {f"{key}.{name}": inner for name, inner in value.items()}
            if isinstance(value, dict)
            else {key: value}
        )
    return entries

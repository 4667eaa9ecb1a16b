"""Workspace files: JSON with the fields of `Workspace`."""

import json
from pathlib import Path

from geometry.atomic import write_json
from geometry.errors import UserError
from vision.tracking.workspace import Workspace


def save_workspace(path: Path, workspace: Workspace) -> None:
    """Write a workspace atomically; `load_workspace` gives the same back."""
    write_json(path, workspace.model_dump(mode="json"))


def load_workspace(path: Path) -> Workspace:
    """Read a workspace.

    Raises:
        UserError: If the file cannot be read or is no workspace.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not JSON"
        raise UserError(f"cannot read the workspace {path}: {reason}") from None
    if not isinstance(content, dict):
        raise UserError(f"{path}: a workspace has fiducials, fiducial_diameter and marker_plane")
    try:
        return Workspace(**content)
    except UserError as error:
        raise UserError(f"{path}: {error}") from None

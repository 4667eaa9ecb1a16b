"""Checkpoints of a training: safetensors files, replaced atomically, with the digest of their problem."""

from collections.abc import Mapping
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file

from geometry.atomic import atomic_path
from geometry.errors import UserError

FILE = "checkpoint.safetensors"


def save_checkpoint(folder: Path, state: Mapping[str, torch.Tensor], digest: str) -> None:
    """Write a state atomically."""
    with atomic_path(folder / FILE) as partial:
        save_file({name: tensor.contiguous() for name, tensor in state.items()}, partial, {"digest": digest})


def load_checkpoint(folder: Path, digest: str) -> dict[str, torch.Tensor] | None:
    """The last saved state, or None if there is none.

    Raises:
        UserError: If it cannot be read, or belongs to another problem or other settings.
    """
    path = folder / FILE
    if not path.exists():
        return None
    try:
        with safe_open(path, "pt") as file:
            saved = (file.metadata() or {}).get("digest")
            state = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (it is no mapping)
    except (SafetensorError, OSError) as error:
        raise UserError(f"{path} cannot be read ({error}); remove it, or train without --resume") from None
    if saved != digest:
        raise UserError(
            f"{path} belongs to another problem or other settings; remove it, or train without --resume"
        )
    return state

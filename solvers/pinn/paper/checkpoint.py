"""Files of a training: checkpoints, with the digest of their problem, and the history.

Checkpoints are safetensors files, replaced atomically; the history is CSV.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.atomic import atomic_path, write_bytes
from pinnray.runtime.errors import UserError

FILE = "checkpoint.safetensors"
UNITS = {"PDE": "MPa", "BC": "mm2", "ASM": "mm2", "total": "MPa", "energy": "N mm/mm", "seconds": "s"}


def save_checkpoint(folder: Path, state: Mapping[str, torch.Tensor], digest: str) -> None:
    """Write a state atomically."""
    folder.mkdir(parents=True, exist_ok=True)
    content = {name: tensor.contiguous() for name, tensor in state.items()}
    write_bytes(folder / FILE, save(content, {"digest": digest}))  # safetensors hides that a disk is full


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
        raise UserError(f"{path} cannot be read ({error}); remove it, or train without resuming") from None
    if saved != digest:
        raise UserError(
            f"{path} belongs to another problem or other settings; remove it, or train without resuming"
        )
    return state


def write_history(folder: Path, columns: Sequence[str], history: FloatArray) -> None:
    """Write `history.csv` from values of shape (epochs, columns)."""
    titles = [f"{name} [{UNITS[name]}]" if name in UNITS else name for name in columns]
    with atomic_path(folder / "history.csv") as partial:
        np.savetxt(partial, history, delimiter=",", header=",".join(titles), comments="", fmt="%.9g")

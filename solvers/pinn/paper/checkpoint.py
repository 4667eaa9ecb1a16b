"""Files of a training: checkpoints, with the digest of their problem, and the history.

Checkpoints are safetensors files, replaced atomically; the history is CSV and, for TensorBoard, event files.
"""

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.atomic import atomic_path, write_bytes
from pinnray.runtime.errors import UserError

FILE = "checkpoint.safetensors"


def save_checkpoint(folder: Path, state: Mapping[str, torch.Tensor], digest: str) -> None:
    """Write a state atomically."""
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


UNITS = {"PDE": "MPa", "BC": "mm2", "ASM": "mm2", "total": "MPa", "energy": "N mm/mm", "seconds": "s"}


class HistoryFiles:
    """Writes `history.csv` and, if TensorBoard is installed, its event files.

    Args:
        folder: Where they are written.
        columns: Names of the columns, the epoch first.
        done: Number of epochs already recorded there.
    """

    def __init__(self, folder: Path, columns: Sequence[str], done: int) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._path, self._columns, self._done = folder / "history.csv", columns, done
        self._board: Any = None
        if find_spec("tensorboard"):
            from torch.utils.tensorboard import SummaryWriter

            self._board = SummaryWriter(folder, purge_step=done + 1)

    def write(self, history: FloatArray) -> None:
        """Write a history of shape (epochs, columns)."""
        titles = [f"{name} [{UNITS[name]}]" if name in UNITS else name for name in self._columns]
        with atomic_path(self._path) as partial:
            np.savetxt(partial, history, delimiter=",", header=",".join(titles), comments="", fmt="%.9g")
        if self._board is not None:
            for row in history[self._done :]:
                for name, value in zip(self._columns[1:], row[1:], strict=True):
                    self._board.add_scalar(name, value, int(row[0]))
            self._board.flush()
            self._done = len(history)

"""Files of a training: checkpoints, with the digest of their problem, and the history.

Checkpoints are torch's files, replaced atomically and read without running code; the history is CSV.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import torch

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.atomic import atomic_path, write_bytes
from pinnray.runtime.errors import UserError

FILE = "checkpoint.pt"
UNITS = {"PDE": "MPa", "BC": "mm2", "ASM": "mm2", "total": "MPa", "energy": "N mm/mm", "seconds": "s"}


@dataclass(frozen=True)
class CheckpointStore:
    """Destination of a training's checkpoint and history."""

    folder: Path  # The folder of the checkpoint and the history
    digest: str  # Of the problem and the settings that determine the result
    resume: bool  # Whether to continue from a checkpoint in the folder

    def save(self, state: dict[str, Any]) -> None:
        """Write a state of tensors and plain values atomically."""
        content = BytesIO()
        torch.save({**state, "digest": self.digest}, content)
        write_bytes(self.folder / FILE, content.getvalue())

    def load(self) -> dict[str, Any] | None:
        """The last saved state, or None if there is none or the training starts anew.

        Raises:
            UserError: If it cannot be read, or belongs to another problem or other settings.
        """
        path, advice = self.folder / FILE, "remove it, or train without resuming"
        if not (self.resume and path.exists()):
            return None
        try:
            state: dict[str, Any] = torch.load(path, "cpu", weights_only=True)
            saved = state.pop("digest")
        except Exception as error:  # torch has no class of its own for a damaged file
            said = str(error).partition("\n")[0]
            raise UserError(f"{path} cannot be read ({said}); {advice}") from None
        if saved != self.digest:
            raise UserError(f"{path} belongs to another problem or other settings; {advice}")
        return state

    def write_history(self, columns: Sequence[str], history: FloatArray) -> None:
        """Write `history.csv` from values of shape (epochs, columns)."""
        titles = [f"{name} [{UNITS[name]}]" if name in UNITS else name for name in columns]
        with atomic_path(self.folder / "history.csv") as partial:
            np.savetxt(partial, history, delimiter=",", header=",".join(titles), comments="", fmt="%.9g")

"""Writes the history of a training as CSV and, for TensorBoard, as event files."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from geometry.arrays import FloatArray
from geometry.atomic import atomic_path

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
        self._board = _summary_writer(folder, done)

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


def _summary_writer(folder: Path, done: int) -> Any:
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError:
        return None
    return SummaryWriter(folder, purge_step=done + 1)

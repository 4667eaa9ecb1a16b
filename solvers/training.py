"""What a solver that trains for long is told about its run: where to save, and what is known."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

from geometry.errors import UserError
from solvers.solver import Solver


class TrainingDiverged(UserError):
    """The training went astray: the message says when and by what, and what to try."""


@dataclass(frozen=True)
class TrainingContext:
    """Where a training run saves its state, and what it may tell meanwhile. It does not change the result.

    Attributes:
        folder: Folder for checkpoints and the history; None to write nothing.
        resume: Whether to go on from the checkpoint in `folder` if there is one.
        reference_energy: Energy of a reference solution per depth, N mm/mm, for the progress text.
    """

    folder: Path | None = None
    resume: bool = False
    reference_energy: float | None = None


@runtime_checkable
class TrainedSolver(Solver, Protocol):
    """A solver whose training can be saved and resumed."""

    def in_context(self, context: TrainingContext) -> Solver:
        """The same solver for a run with this context, which is no part of its settings."""
        ...

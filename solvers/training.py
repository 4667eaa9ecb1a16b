"""Runtime context of trained solvers: checkpoint folder, resume flag, reference energy."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

from geometry.errors import UserError
from solvers.solver import Solver


class TrainingDiverged(UserError):
    """The training diverged; the message says when, by which quantity, and what to try."""


@dataclass(frozen=True)
class TrainingContext:
    """Runtime context of a training, which does not change its result.

    Attributes:
        folder: Folder for checkpoints and the history; None to write nothing.
        resume: Whether to continue from the checkpoint in `folder` if there is one.
        reference_energy: Energy of a reference solution per depth, N mm/mm, for the progress text.
    """

    folder: Path | None = None
    resume: bool = False
    reference_energy: float | None = None


@runtime_checkable
class TrainedSolver(Solver, Protocol):
    """A solver whose training can be saved and resumed."""

    def in_context(self, context: TrainingContext) -> Solver:
        """The same solver with this context, which is no setting."""
        ...

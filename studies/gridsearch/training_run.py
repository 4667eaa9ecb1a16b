"""A training at a point of the grid."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf

from pinnray.studies.sweep.measurement import Measurement
from pinnray.studies.sweep.quantities import TRAINING

TRAINED, DIVERGED, FAILED = "trained", "diverged", "failed"


@dataclass(frozen=True)
class GridPoint:
    """A learning rate of the optimiser and a weight of the boundary conditions, MPa/mm²."""

    learning_rate: float
    bc_weight: float


@dataclass(frozen=True)
class TrainingRun:
    """The end of the training at a point of the grid: the quantities of `TRAINING`, None unless trained."""

    point: GridPoint
    status: str
    message: str
    measured: Mapping[str, float] | None = None

    @classmethod
    def of(cls, point: GridPoint, ended: Measurement) -> "TrainingRun":
        """The run of a sample."""
        if measured := {name: ended.values[name] for name in TRAINING if name in ended.values}:
            measured["epochs"] = int(measured["epochs"])
            return cls(point, TRAINED, ended.message, measured)
        return cls(point, DIVERGED if ended.state == "not converged" else FAILED, ended.message)

    @property
    def distance(self) -> float:
        """Relative L2 difference of the displacement from `fem`; infinite unless trained."""
        return self.measured["rel_l2_displacement"] if self.measured else inf


def best_of(runs: Sequence[TrainingRun]) -> TrainingRun | None:
    """The run nearest to `fem`; None if none was trained."""
    return min((run for run in runs if run.measured), key=lambda run: run.distance, default=None)

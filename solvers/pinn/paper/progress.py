"""What a person is told while a network trains."""

import time
from dataclasses import dataclass, field

from solvers.pinn.paper.loss_gradient import Evaluation
from solvers.solver import Progress


@dataclass(frozen=True)
class TrainingProgress:
    """Reports epochs, loss terms, energy and the time left.

    Attributes:
        progress: Who is told.
        epochs: How many there are to be.
        done: How many were done before this run.
        area: What the mean energy density is multiplied by to give the energy, mm².
        reference: Energy of a reference solution, N mm/mm.
        started: When this run started, s.
    """

    progress: Progress
    epochs: int
    done: int
    area: float
    reference: float | None
    started: float = field(default_factory=time.perf_counter)

    def __call__(self, epoch: int, evaluation: Evaluation) -> None:
        """Report the state after an epoch."""
        energy = self.area * evaluation.terms["PDE"]
        terms = ", ".join(f"{name} {value:.3g}" for name, value in evaluation.terms.items())
        ratio = f" ({energy / self.reference:.3g} x reference)" if self.reference else ""
        pace = (time.perf_counter() - self.started) / (epoch - self.done)
        self.progress(
            epoch / self.epochs,
            f"epoch {epoch} of {self.epochs}: {terms}, energy {energy:.4g} N mm/mm{ratio}, "
            f"{_duration(pace * (self.epochs - epoch))} left",
        )


def _duration(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 100 * 60 else f"{seconds / 3600:.1f} h"

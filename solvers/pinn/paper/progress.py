"""Progress text of a training."""

import time
from dataclasses import dataclass, field

from solvers.pinn.paper.loss_gradient import LossEvaluation
from solvers.solver import Progress


@dataclass(frozen=True)
class TrainingProgress:
    """Reports epochs, loss terms, energy and the time left.

    Attributes:
        progress: Receives the text.
        epochs: Number of epochs in all.
        done: Number of epochs before this run.
        area: Of the body, mm², which times the mean energy density is the energy.
        reference: Energy of a reference solution, N mm/mm.
        started: Start of this run, s.
    """

    progress: Progress
    epochs: int
    done: int
    area: float
    reference: float | None
    started: float = field(default_factory=time.perf_counter)

    def __call__(self, epoch: int, evaluation: LossEvaluation) -> None:
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

"""The training loop: epochs of Adam with history, checkpoints and divergence check."""

import math
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.pinn.paper.checkpoint import load_checkpoint, save_checkpoint, write_history
from pinnray.solvers.pinn.paper.loss import Loss, LossEvaluation
from pinnray.solvers.solver import Progress, TrainingDiverged

DIVERGED = 1e3
"""Ratio of the loss to its first value above which the training has diverged."""


@dataclass(frozen=True)
class TrainingSettings:
    """Settings of the training; see `PaperPinnSolver` for their meaning."""

    learning_rate: float
    epochs: int
    checkpoint_every: int


@dataclass(frozen=True)
class CheckpointStore:
    """Destination of a training's checkpoint and history."""

    folder: Path  # The folder of the checkpoint and the history
    digest: str  # Of the problem and the settings that determine the result
    resume: bool  # Whether to continue from a checkpoint in the folder


class Training:
    """A training that can be run, saved and resumed.

    Args:
        loss: The loss.
        initial: Initial parameters, shape (networks, parameters); they are changed in place.
        settings: Of the training.
        area: Of the body, mm², which times the mean energy density is the energy.
        store: Destination of checkpoint and history; None for none.
    """

    def __init__(
        self,
        loss: Loss,
        initial: torch.Tensor,
        settings: TrainingSettings,
        area: float,
        store: CheckpointStore | None,
    ) -> None:
        self.parameters = initial
        self.columns = ("epoch", *loss.factors, "total", "energy", "seconds")
        self._loss, self._settings, self._area, self._store = loss, settings, area, store
        self._stepper = torch.optim.Adam([initial], lr=settings.learning_rate)
        self._rows: list[tuple[float, ...]] = []
        saved = load_checkpoint(store.folder, store.digest) if store and store.resume else None
        if saved:
            self._restore(saved)
        self._started = time.perf_counter() - (self._rows[-1][-1] if self._rows else 0.0)

    @property
    def epoch(self) -> int:
        """Number of epochs done."""
        return len(self._rows)

    @property
    def history(self) -> FloatArray:
        """The columns of every epoch, shape (epochs, columns); losses are those before the epoch's step."""
        return np.array(self._rows).reshape(-1, len(self.columns))

    def run(self, progress: Progress, reference: float | None) -> None:
        """Train up to the settings' number of epochs, and report each.

        Args:
            progress: Receives the terms of the loss, the energy and the time left.
            reference: Energy of a reference solution, N mm/mm.

        Raises:
            TrainingDiverged: If the loss is not a number or has grown beyond all bounds.
        """
        last, done, started = self._state(), self.epoch, time.perf_counter()
        try:
            while self.epoch < self._settings.epochs:
                evaluation = self._step()
                last = self._state()
                if self._settings.checkpoint_every and self.epoch % self._settings.checkpoint_every == 0:
                    self._save(last)
                pace = (time.perf_counter() - started) / (self.epoch - done)
                progress(self.epoch / self._settings.epochs, self._text(evaluation, pace, reference))
        except KeyboardInterrupt:
            self._save(last)
            raise
        self._save(last)

    def _step(self) -> LossEvaluation:
        """One step of the optimiser."""
        evaluation = self._loss(self.parameters)
        terms, total, self.parameters.grad = evaluation
        self._check(total)
        self._stepper.step()
        seconds = time.perf_counter() - self._started
        self._rows.append((self.epoch + 1, *terms.values(), total, self._area * terms["PDE"], seconds))
        return evaluation

    def _text(self, evaluation: LossEvaluation, pace: float, reference: float | None) -> str:
        energy, epochs = self._area * evaluation.terms["PDE"], self._settings.epochs
        terms = ", ".join(f"{name} {value:.3g}" for name, value in evaluation.terms.items())
        ratio = f" ({energy / reference:.3g} x reference)" if reference else ""
        return (
            f"epoch {self.epoch} of {epochs}: {terms}, energy {energy:.4g} N mm/mm{ratio}, "
            f"{_duration(pace * (epochs - self.epoch))} left"
        )

    def _check(self, total: float) -> None:
        first = self._rows[0][self.columns.index("total")] if self._rows else total
        if math.isfinite(total) and total <= DIVERGED * first:
            return
        what = (
            f"grew to {total / first:.3g} times its first value"
            if math.isfinite(total)
            else f"became {total}"
        )
        raise TrainingDiverged(
            f"the loss {what} in epoch {self.epoch + 1}; take a learning_rate below "
            f"{self._settings.learning_rate:g} or smaller weights of the loss"
        )

    def _state(self) -> tuple[int, dict[str, torch.Tensor]]:
        """The epoch and a copy of parameters and optimiser state, safe from an interrupt within a step."""
        state = {"parameters": self.parameters.clone()}
        for name, value in self._stepper.state[self.parameters].items():
            state[f"optimiser.{name}"] = value.clone()
        return self.epoch, state

    def _restore(self, state: dict[str, torch.Tensor]) -> None:
        self.parameters.copy_(state.pop("parameters"))
        self._rows = [tuple(row) for row in state.pop("history").tolist()]
        values = {name.removeprefix("optimiser."): value for name, value in state.items()}
        groups = self._stepper.state_dict()["param_groups"]
        self._stepper.load_state_dict({"state": {0: values} if values else {}, "param_groups": groups})

    def _save(self, state: tuple[int, dict[str, torch.Tensor]]) -> None:
        if self._store is None:
            return
        epoch, tensors = state
        history = self.history[:epoch]
        save_checkpoint(
            self._store.folder, {**tensors, "history": torch.from_numpy(history)}, self._store.digest
        )
        write_history(self._store.folder, self.columns, history)


def _duration(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 100 * 60 else f"{seconds / 3600:.1f} h"

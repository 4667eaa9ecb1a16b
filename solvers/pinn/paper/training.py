"""The training loop: epochs of Adam with history, checkpoints and divergence check."""

import math
import time
from collections.abc import Mapping
from copy import deepcopy
from typing import Any

import numpy as np
import torch

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.pinn.paper.checkpoint import CheckpointStore
from pinnray.solvers.pinn.paper.loss import Loss
from pinnray.solvers.solver import Progress, TrainingDiverged

DIVERGED = 1e3
"""Ratio of the loss to its first value above which the training has diverged."""
UNREAD = 100
"""Epochs on a GPU between two times that the losses are read, for which it must stop."""
WARM_UP = 3
"""Epochs on a GPU before one is captured: the first ones allocate and initialise."""


class Training:
    """A training that can be run, saved and resumed.

    Args:
        loss: The loss.
        initial: Initial parameters, shape (networks, parameters); they are changed in place.
        area: Of the body, mm², which times the mean energy density is the energy.
        store: Destination of checkpoint and history; None for none.
        learning_rate: Of Adam.
    """

    def __init__(
        self,
        loss: Loss,
        initial: torch.Tensor,
        area: float,
        store: CheckpointStore | None,
        learning_rate: float,
    ) -> None:
        self.parameters = initial
        self.columns = ("epoch", *loss.factors, "total", "energy", "seconds")
        self._loss, self._area, self._store = loss, area, store
        initial.grad = self._gradient = torch.zeros_like(initial)
        self._stepper = torch.optim.Adam([initial], lr=learning_rate, capturable=initial.is_cuda)
        self._together = UNREAD if initial.is_cuda else 1
        self._losses = initial.new_zeros(UNREAD, len(loss.factors) + 1, dtype=torch.float64)
        self._unread = torch.zeros(1, dtype=torch.int64, device=initial.device)
        self._warm, self._advance = 0, self._eagerly_on_a_gpu if initial.is_cuda else self._step
        self._rows: list[tuple[float, ...]] = []
        if store and (saved := store.load()):
            self.parameters.copy_(saved["parameters"])
            for group in saved["optimiser"]["param_groups"]:
                group["capturable"] = initial.is_cuda  # another device's training may go on here
            self._stepper.load_state_dict(saved["optimiser"])
            self._rows = [tuple(row) for row in saved["history"].tolist()]
        self._started = time.perf_counter() - (self._rows[-1][-1] if self._rows else 0.0)

    @property
    def epoch(self) -> int:
        """Number of epochs done."""
        return len(self._rows)

    @property
    def history(self) -> FloatArray:
        """The columns of every epoch, shape (epochs, columns); losses are those before the epoch's step."""
        return np.array(self._rows).reshape(-1, len(self.columns))

    def run(self, epochs: int, checkpoint_every: int, progress: Progress) -> None:
        """Train, and report the terms of the loss and the energy: on a GPU after `UNREAD` epochs, else each.

        Args:
            epochs: In all, those of a checkpoint included.
            checkpoint_every: Epochs between checkpoints; 0 for one at the end alone.
            progress: Receives them.

        Raises:
            TrainingDiverged: If the loss is not a number or has grown beyond all bounds.
        """
        last = self._state()
        try:
            while self.epoch < epochs:
                left = checkpoint_every - self.epoch % checkpoint_every if checkpoint_every else epochs
                terms = self._epochs(min(self._together, epochs - self.epoch, left))
                last = self._state()
                if checkpoint_every and self.epoch % checkpoint_every == 0:
                    self._save(last)
                progress(self.epoch / epochs, f"epoch {self.epoch} of {epochs}: {self._said(terms)}")
        except KeyboardInterrupt:
            self._save(last)
            raise
        self._save(last)

    def _epochs(self, count: int) -> Mapping[str, float]:
        """Some epochs, whose losses are then read; the terms of the last one before its step."""
        self._unread.zero_()
        for _ in range(count):
            self._advance()
        read = self._losses[:count].tolist()
        before = self._rows[-1][-1] if self._rows else 0.0
        clock = np.linspace(before, time.perf_counter() - self._started, count + 1)[1:]
        for values, seconds in zip(read, clock.tolist(), strict=True):
            terms = dict(zip(self._loss.factors, values[:-1], strict=True))
            self._check(values[-1])
            self._rows.append((self.epoch + 1, *values, self._area * terms["PDE"], seconds))
        return terms

    def _step(self) -> None:
        """One step of the optimiser; the loss before it stays on the device."""
        found = self._loss(self.parameters)
        self._losses.index_copy_(0, self._unread, found.values[None])
        self._unread += 1
        self._gradient.copy_(found.gradient)
        self._stepper.step()

    def _eagerly_on_a_gpu(self) -> None:
        """A step beside the default stream, as a graph needs; those after `WARM_UP` repeat one graph.

        Launched one by one, the kernels of an epoch take far longer to start than to run.
        """
        beside = torch.cuda.Stream()
        beside.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(beside):
            self._step()
        torch.cuda.current_stream().wait_stream(beside)
        self._warm += 1
        if self._warm == WARM_UP:
            graph = torch.cuda.CUDAGraph()
            with torch.cuda.graph(graph):
                self._step()
            self._advance = graph.replay

    def _said(self, terms: Mapping[str, float]) -> str:
        values = ", ".join(f"{name} {value:.3g}" for name, value in terms.items())
        return f"{values}, energy {self._area * terms['PDE']:.4g} N mm/mm"

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
            f"{self._stepper.defaults['lr']:g} or smaller weights of the loss"
        )

    def _state(self) -> dict[str, Any]:
        """A copy of parameters and optimiser state, safe from an interrupt within a step."""
        return {
            "epoch": self.epoch,
            "parameters": self.parameters.clone(),
            "optimiser": deepcopy(self._stepper.state_dict()),
        }

    def _save(self, state: dict[str, Any]) -> None:
        if self._store is not None:
            history = self.history[: state["epoch"]]
            self._store.save({**state, "history": torch.from_numpy(history)})
            self._store.write_history(self.columns, history)

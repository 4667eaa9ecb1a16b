"""The training loop: an optimiser, epochs, and a record of them."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch

from geometry.arrays import FloatArray
from solvers.pinn.loss_gradient import Evaluation, Loss

OPTIMISERS: dict[str, Callable[..., torch.optim.Optimizer]] = {"adam": torch.optim.Adam}
"""By the names of the settings; called with the parameters and `lr`."""


@dataclass(frozen=True, eq=False)
class Trained:
    """The result of a training.

    Attributes:
        parameters: Shape (networks, parameters).
        history: A row for every epoch: its number, the terms, the total and the seconds.
    """

    parameters: torch.Tensor
    history: FloatArray


def train(
    loss: Loss,
    parameters: torch.Tensor,
    *,
    optimiser: str,
    learning_rate: float,
    epochs: int,
    report: Callable[[int, Evaluation], None],
) -> Trained:
    """Minimise the loss; `report` is called after every epoch."""
    started = time.perf_counter()
    stepper = OPTIMISERS[optimiser]([parameters], lr=learning_rate)
    rows = []
    evaluations: list[Evaluation] = []

    def closure() -> float:
        evaluations.append(loss(parameters))
        parameters.grad = evaluations[-1].gradient
        return evaluations[-1].total

    for epoch in range(1, epochs + 1):
        evaluations.clear()
        stepper.step(closure)
        start = evaluations[0]
        rows.append((epoch, *start.terms.values(), start.total, time.perf_counter() - started))
        report(epoch, start)
    return Trained(parameters, np.array(rows))

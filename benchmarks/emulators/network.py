"""Modes of load paths with a small network for their coefficients, in the place of Gaussian processes."""

import numpy as np
import torch
from scipy.interpolate import CubicSpline

from geometry.arrays import FloatArray
from studies.fields.emulator import LEAST, LEAST_OF_PATHS, POWERS, places
from studies.fields.reduction import Modes
from studies.fields.snapshots import Snapshots

WIDTH, DECAY, STEPS, RATE, MEMBERS = 64, 1e-2, 8000, 3e-3, 5
"""Width and decay were chosen on 22 of the samples; the mean of five networks is taken."""


class ModeNetwork:
    """Predicts displacement and numbers of a path."""

    def __init__(self, known: Snapshots) -> None:
        count, strokes, nodes, _ = known.nodal.shape
        self.known, self.strokes = known, strokes
        self.space, coefficients = Modes.of_fields(known.nodal.reshape(-1, nodes, 2), known.space, LEAST)
        paths = coefficients.reshape(count, strokes, -1) / known.shares[:, None]
        numbers = known.numbers / known.shares[:, None] ** POWERS
        self.units = np.abs(numbers).mean(axis=(0, 1))
        parts = [paths.reshape(count, -1), (numbers / self.units).reshape(count, -1)]
        self.modes, rows = zip(*(Modes.of(each, LEAST_OF_PATHS) for each in parts), strict=True)
        self.sizes = [float(np.sqrt((each**2).sum(1).mean())) for each in rows]
        wanted = np.concatenate([each / size for each, size in zip(rows, self.sizes, strict=True)], axis=1)
        inputs = places(known.inputs, known.samples)
        self.members = [_fitted(inputs, wanted, seed) for seed in range(MEMBERS)]

    def path(self, inputs: FloatArray, share: float) -> tuple[FloatArray, FloatArray]:
        """Displacement (N, 2), mm, and numbers of a load at a share of the full stroke."""
        at = torch.tensor(inputs)
        with torch.no_grad():
            found = np.mean([net(at).numpy() * scale for net, scale in self.members], axis=0)
        weights = CubicSpline(self.known.shares, np.eye(self.strokes))(share)
        field, numbers = (
            modes.combined(part * size).reshape(self.strokes, -1)
            for modes, part, size in zip(
                self.modes, np.split(found, [len(self.modes[0].vectors)]), self.sizes, strict=True
            )
        )
        nodal = share * self.space.combined(weights @ field).reshape(-1, 2)
        return nodal, (weights @ numbers) * self.units * share**POWERS


def _fitted(inputs: FloatArray, wanted: FloatArray, seed: int) -> tuple[torch.nn.Module, FloatArray]:
    torch.manual_seed(seed)
    net = torch.nn.Sequential(
        *(torch.nn.Linear(inputs.shape[1], WIDTH), torch.nn.Tanh(), torch.nn.Linear(WIDTH, WIDTH)),
        *(torch.nn.Tanh(), torch.nn.Linear(WIDTH, wanted.shape[1])),
    ).double()
    scale = np.sqrt((wanted**2).mean(axis=0))
    given, goal, weight = (
        torch.tensor(inputs),
        torch.tensor(wanted / scale),
        torch.tensor(scale / np.linalg.norm(scale)),
    )
    optimiser = torch.optim.AdamW(net.parameters(), lr=RATE, weight_decay=DECAY)
    cooling = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, STEPS)
    for _ in range(STEPS):
        optimiser.zero_grad()
        (weight * (net(given) - goal) ** 2).sum(1).mean().backward()
        optimiser.step()
        cooling.step()
    return net, scale

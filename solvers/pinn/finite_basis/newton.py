"""Newton's method for a finite-basis network, the load applied in adaptive steps."""

from typing import NamedTuple

import numpy as np
import torch

from solvers.pinn.finite_basis.equilibrium import Equilibrium, Level
from solvers.solver import Progress

FIRST_STEP, MAX_STEP, MIN_STEP = 0.1, 0.25, 1e-3
"""Fractions of the load in one step."""
TOLERANCE = 1e-10
"""Newton stops when a step changes this part of the energy; the error after it is far smaller."""
MAX_ITERATIONS = 12


class Path(NamedTuple):
    """How far the load could be applied.

    Attributes:
        fraction: Of the load.
        state: Equilibrium there.
        iterations: Newton iterations so far.
    """

    fraction: float
    state: Equilibrium
    iterations: int

    @classmethod
    def start(cls, level: Level) -> "Path":
        """No load yet."""
        return cls(0.0, Equilibrium(level.rest, np.zeros(len(level.values)), 0.0), 0)

    def to(self, fraction: float, state: Equilibrium | None, iterations: int) -> "Path":
        """With more iterations, which led to a state at a fraction of the load or, if None, nowhere."""
        if state is None:
            return self._replace(iterations=self.iterations + iterations)
        return Path(fraction, state, self.iterations + iterations)


def equilibrium(level: Level, guess: torch.Tensor, fraction: float) -> tuple[Equilibrium | None, int]:
    """Equilibrium under a fraction of the load, None if the iteration fails, and the iterations taken."""
    for iteration in range(1, MAX_ITERATIONS + 1):
        state = level.step(guess, fraction)
        if state is None:
            return None, iteration
        if state.change < TOLERANCE:
            return state, iteration
        guess = state.output
    return None, MAX_ITERATIONS


def follow_load(level: Level, progress: Progress) -> Path:
    """Apply the load in steps that start from the last two states, continued on a straight line.

    A step whose iteration fails is halved; one that takes few iterations is doubled.
    """
    path = before = Path.start(level)
    step = FIRST_STEP
    while path.fraction < 1 and step >= MIN_STEP:
        fraction = min(path.fraction + step, 1.0)
        guess = path.state.output
        if path.fraction > 0:
            ahead = (fraction - path.fraction) / (path.fraction - before.fraction)
            guess = guess + ahead * (guess - before.state.output)
        state, iterations = equilibrium(level, guess, fraction)
        before, path = path if state else before, path.to(fraction, state, iterations)
        if state is None:
            step /= 2
            continue
        progress(fraction, f"{fraction:.0%} of the load, {iterations} Newton iterations")
        step = min(MAX_STEP, step * (2 if iterations <= 5 else 1))
    return path

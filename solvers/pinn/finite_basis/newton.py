"""Newton's method for a finite-basis network, with the load applied in adaptive steps."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
import torch

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.contact.contact_region import ContactRegion
from pinnray.solvers.pinn.finite_basis.constrained_network import ConstrainedNetwork, NewtonIterate
from pinnray.solvers.pinn.finite_basis.energy import REGULARISATION
from pinnray.solvers.pinn.finite_basis.network import FiniteBasisField
from pinnray.solvers.solver import Progress
from pinnray.solvers.stability import ShiftedStep, aside, descended

FIRST_STEP, MAX_STEP, MIN_STEP = 0.1, 0.25, 1e-3
"""Fractions of the load in one step."""
TOLERANCE = 1e-10
"""Newton stops when a step changes this part of the energy; the error after it is far smaller."""
MAX_ITERATIONS = 12
SETTLED, SLOW = 1e-6, 0.1
"""Newton also stops at a change below the first that is no less than the second times the one before.

The regularisation damps steps along nearly dependent basis functions, as in a slender bar, so that what is
left there of the energy falls slowly. It is far below the error of the network.
"""
LEAP = 2.0
"""Growth of the energy over its least value at which Newton's method has leapt away."""


class LoadStep(NamedTuple):
    """Equilibrium under a fraction of the load."""

    fraction: float  # Of the load
    state: NewtonIterate  # Equilibrium there
    iterations: int  # Newton iterations so far
    region: ContactRegion | None = None  # Where a cylinder touches; None without one, and where it does not


class Level(NamedTuple):
    """A refinement level."""

    network: ConstrainedNetwork
    reached: LoadStep  # Its last equilibrium

    @property
    def field(self) -> FiniteBasisField:
        """The displacement of the last equilibrium."""
        return self.network.field(self.reached.state.output)


Reach = Callable[[NewtonIterate, float], tuple[NewtonIterate | None, int]]
"""Equilibrium under a fraction of the load from a guess, None if it is not found, and the iterations."""


def find_equilibrium(
    network: ConstrainedNetwork, guess: torch.Tensor, fraction: float
) -> tuple[NewtonIterate | None, int]:
    """Equilibrium under a fraction of the load, None if the iteration fails, and the iterations taken.

    An unstable one is left for a stable one beside it; where none is found, it is the result. Where Newton's
    method leaps away, as near the load at which a part buckles, its lowest iterate is followed down instead.
    """
    before = least = np.inf
    lowest = None
    for iteration in range(1, MAX_ITERATIONS + 1):
        state = network.step(guess, fraction)
        if state is None:
            break
        slow = SLOW * before < state.change < SETTLED
        if state.change < TOLERANCE or slow:
            return (_stable(network, state, fraction) if state.unstable else state), iteration
        guess, before = state.output, state.change  # from now on the guess has the prescribed displacement
        energy = network.energy_with_springs(guess.numpy(), fraction)
        if energy < least:
            lowest, least = guess, energy
        elif not energy < LEAP * least:
            break
    return None if lowest is None else least_energy(network, lowest.numpy(), fraction), iteration


def _stable(network: ConstrainedNetwork, state: NewtonIterate, fraction: float) -> NewtonIterate:
    """A stable equilibrium beside an unstable one, of two to either side the lower; itself if none is found.

    The step aside is the response to random forces of a tangent that is nearly singular in soft directions.
    """
    energy = partial(network.energy_with_springs, fraction=fraction)
    starts = aside(state.output.numpy(), network.softest(state.output), energy)
    found = [settled for start in starts if (settled := least_energy(network, start, fraction))]
    return min(found, key=lambda each: energy(each.output.numpy()), default=state)


def least_energy(network: ConstrainedNetwork, start: FloatArray, fraction: float) -> NewtonIterate | None:
    """The stable equilibrium to which the energy falls from an output layer; None if none is reached.

    Args:
        network: The network.
        start: Shape (c, 2, m + 1), mm, under the same prescribed displacement.
        fraction: Of the load.
    """

    def step(output: FloatArray, shift: float) -> ShiftedStep | None:
        taken = network.step(torch.from_numpy(output), fraction, max(shift, REGULARISATION))
        return None if taken is None else ShiftedStep(taken.output.numpy() - output, taken.unstable)

    energy = partial(network.energy_with_springs, fraction=fraction)
    lower = descended(start, energy, step)
    settled = None if lower is None else network.step(torch.from_numpy(lower), fraction)
    return None if settled is None or settled.unstable else settled


def follow_load(
    rest: NewtonIterate, reach: Reach, progress: Progress, *, longest: float = MAX_STEP, quick: float = 5
) -> LoadStep:
    """Apply the load in steps that start from the last two states, extrapolated linearly.

    A step whose iteration fails is halved.

    Args:
        rest: Without load.
        reach: Finds the equilibrium of a step.
        progress: Told of every step.
        longest: Largest fraction of the load in a step.
        quick: Most iterations of a step that is doubled.

    Returns:
        The last equilibrium, below the full load where Newton's method fails beyond it.
    """
    last = before = LoadStep(0.0, rest, 0)
    step = min(FIRST_STEP, longest)
    while last.fraction < 1 and step >= MIN_STEP:
        fraction = min(last.fraction + step, 1.0)
        guess = last.state
        if last.fraction > 0:
            ahead = (fraction - last.fraction) / (last.fraction - before.fraction)
            guess = guess._replace(output=guess.output + ahead * (guess.output - before.state.output))
        state, iterations = reach(guess, fraction)
        iterations_in_all = last.iterations + iterations
        if state is None:
            last = last._replace(iterations=iterations_in_all)
            step /= 2
            continue
        before, last = last, LoadStep(fraction, state, iterations_in_all)
        progress(fraction, f"{fraction:.0%} of the load, {iterations} Newton iterations")
        step = min(longest, step * (2 if iterations <= quick else 1))
    return last

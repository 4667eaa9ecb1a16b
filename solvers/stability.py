"""From an unstable equilibrium down to stable ones: Newton's method with a shifted tangent and a line search.

Source: J. Nocedal, S. J. Wright, Numerical Optimization, 2nd edition, Springer 2006, section 3.4 (a multiple
of the identity is added to an indefinite Hessian until it is positive definite).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pinnray.runtime.arrays import FloatArray

FIRST_SHIFT, SHIFT_FACTOR = 1e-8, 10.0
"""Smallest shift over the stiffness that a caller scales by, and its growth until the tangent is definite."""
ITERATIONS = 100


class ShiftedStep(NamedTuple):
    """A Newton step that keeps the constraints."""

    change: FloatArray  # Of the state
    unstable: int  # Number of directions in which the shifted tangent lets the energy fall


def descended(
    start: FloatArray,
    energy: Callable[[FloatArray], float],
    step: Callable[[FloatArray, float], ShiftedStep | None],
) -> FloatArray | None:
    """The state of least energy below a start that fulfils the constraints; None if none is reached.

    Args:
        start: Array of any shape.
        energy: Of a state; infinite or not a number where a point is turned inside out.
        step: Newton's step at a state with a shift of the tangent's diagonal; None if it cannot be taken.
    """
    state, least, shift, stuck = start, energy(start), 0.0, False
    for _ in range(ITERATIONS):
        shift = shift / SHIFT_FACTOR if shift > FIRST_SHIFT else 0.0
        while (taken := step(state, shift)) is not None and taken.unstable:
            shift = max(SHIFT_FACTOR * shift, FIRST_SHIFT)
        if taken is None:
            return None
        length, shortest = 1.0, 2.0**-20
        while length >= shortest and not (value := energy(state + length * taken.change)) < least:
            length /= 2
        if length < shortest:  # at the bottom, or the shift is needed no more
            if not shift or stuck:
                return None if shift else state
            stuck, shift = True, 0.0
            continue
        ended = not shift and length == 1 and least - value < 1e-9 * abs(least)
        state, least, stuck = state + length * taken.change, value, False
        if ended:
            return state
    return None


def aside(
    state: FloatArray, direction: FloatArray, energy: Callable[[FloatArray], float]
) -> list[FloatArray]:
    """States to both sides of a state along a direction, each as far as the energy falls."""
    found = []
    for side in (1.0, -1.0):
        step = side * 1e-3 * np.abs(state).max() / np.abs(direction).max() * direction
        value = energy(state + step)
        while (next_value := energy(state + 2 * step)) < value:
            step, value = 2 * step, next_value
        found.append(state + step)
    return found

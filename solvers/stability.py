"""From an unstable equilibrium down to stable ones: Newton's method with a shifted tangent and a line search.

Source: J. Nocedal, S. J. Wright, Numerical Optimization, 2nd edition, Springer 2006, section 3.4 (a multiple
of the identity is added to an indefinite Hessian until it is positive definite).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from geometry.arrays import FloatArray

FIRST_SHIFT, GROWTH = 1e-8, 10.0
"""Smallest shift over the stiffness that a caller scales by, and its growth until the tangent is definite."""
SIDEWAYS = 1e-3
"""First step aside from an unstable equilibrium over the largest displacement; doubled while energy falls."""
ITERATIONS = 100
SHORTEST = 2.0**-20
"""Share of a step below which the energy does not fall any more."""
SMALL = 1e-9
"""Fall of the energy over itself by a whole Newton step at which the descent ends."""


class Step(NamedTuple):
    """A Newton step that keeps the constraints."""

    change: FloatArray  # Of the state
    unstable: int  # Number of directions in which the shifted tangent lets the energy fall


def descended(
    start: FloatArray,
    energy: Callable[[FloatArray], float],
    step: Callable[[FloatArray, float], Step | None],
) -> FloatArray | None:
    """State of least energy reached by descent from a start that fulfils the constraints; None if none is reached.

    Args:
        start: Of any shape.
        energy: Of a state; infinite or not a number where a point is turned inside out.
        step: Newton's step at a state with a shift of the tangent's diagonal; None if it cannot be taken.
    """
    state, least, shift, stuck = start, energy(start), 0.0, False
    for _ in range(ITERATIONS):
        shift = shift / GROWTH if shift > FIRST_SHIFT else 0.0
        while (taken := step(state, shift)) is not None and taken.unstable:
            shift = max(GROWTH * shift, FIRST_SHIFT)
        if taken is None:
            return None
        length = 1.0
        while length >= SHORTEST and not (value := energy(state + length * taken.change)) < least:
            length /= 2
        if length < SHORTEST:  # at the bottom, or the shift is needed no more
            if not shift or stuck:
                return None if shift else state
            stuck, shift = True, 0.0
            continue
        ended = not shift and length == 1 and least - value < SMALL * abs(least)
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
        step = side * SIDEWAYS * np.abs(state).max() / np.abs(direction).max() * direction
        value = energy(state + step)
        while (next_value := energy(state + 2 * step)) < value:
            step, value = 2 * step, next_value
        found.append(state + step)
    return found

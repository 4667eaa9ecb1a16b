"""An order of the markers in which their displacements are much nearer to those expected."""

import numpy as np
from scipy.optimize import linear_sum_assignment

from pinnray.runtime.arrays import FloatArray, IntArray

MUCH_NEARER = 0.75
"""Share of the distance from a linear finger to which another order of the markers has to bring them to be
suspected: 0.53 to 0.58 where they were in reverse order, numbered one off or had their walls swapped."""


def likely_order(moved: FloatArray, expected: FloatArray, share: float = 1.0) -> IntArray | None:
    """The order in which displacements are nearest to expected ones, or None if the given one is not far off.

    Args:
        moved: Displacements, shape (m, 2), mm.
        expected: What is expected of the same markers up to a factor, shape (m, 2), mm.
        share: The share of the given order's distance from the expected ones to which another has to come.

    Returns:
        Rows of `moved`, shape (m,): the one of the first marker first.
    """
    size = float((moved * expected).sum() / max(float((expected**2).sum()), np.finfo(float).tiny))
    apart = ((moved[:, None] - abs(size) * expected) ** 2).sum(axis=2)
    rows, places = linear_sum_assignment(apart)
    order = rows[np.argsort(places)]
    nearer = _distance(moved[order], expected) < share * _distance(moved, expected)
    return order if nearer and (order != np.arange(len(order))).any() else None


def order_words(order: IntArray, numbers: IntArray) -> str:
    """An order of rows in words, with the markers' numbers."""
    count = len(order)
    if (order == np.arange(count)[::-1]).all():
        return "in reverse order"
    for off, said in ((1, "numbered one on"), (-1, "numbered one back")):
        if (order == np.roll(np.arange(count), off)).all():
            return said
    if len(swapped := np.flatnonzero(order != np.arange(count))) == 2:
        return f"with {numbers[swapped[0]]} and {numbers[swapped[1]]} swapped"
    return f"in the order of the rows {' '.join(map(str, numbers[order]))}"


def _distance(moved: FloatArray, expected: FloatArray) -> float:
    """Distance of displacements from the nearest multiple of expected ones, mm."""
    size = float((moved * expected).sum() / max(float((expected**2).sum()), np.finfo(float).tiny))
    return float(np.linalg.norm(moved - size * expected))

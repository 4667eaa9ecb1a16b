"""The likeliest order of points in a second picture, and which way its y runs.

Displacements are normally distributed: a smooth field, a turn, a change of scale and any shift of the
picture, and independent errors. The sizes of field and errors are those that make an order likeliest, of a
few: so nothing need be known of the finger, and a strange but smooth displacement counts for the order given.
Lengths are relative to the extent of the points.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from pinnray.geometry.picture_frame import FREE
from pinnray.runtime.arrays import FloatArray, IntArray

SMOOTH = 0.5
"""Distance at which displacements of the field are no longer alike."""
SIZES, ERRORS = (0.003, 0.01, 0.03, 0.1, 0.2), (3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1)
"""Standard deviations of the field and of the errors."""
SURE = 10.0
"""Gain in logarithmic likelihood from which on another order counts as the right one."""
ODD = 3.0
"""Lead in logarithmic likelihood from which on one point counts as astray."""
GAINED = 1e-6
"""Smallest gain of an exchange, relative, above what rounding makes."""
MOST = 60
"""Number of points above which the search takes too long."""


class PointOrder(NamedTuple):
    """How a second picture's points most likely belong to those of the first."""

    order: IntArray  # Point of the second picture for every point of the first, shape (m,)
    flipped: bool  # Whether y runs the other way
    gain: float  # Logarithmic likelihood beyond that of the points as given


def likeliest_order(
    points: FloatArray, shown: FloatArray, *, expected: FloatArray | None = None, may_flip: bool = False
) -> PointOrder:
    """The likeliest order of what the second picture shows of points; as given, unless it is `SURE`.

    Args:
        points: In the first picture, shape (m, 2).
        shown: Their places in the second picture, shape (m, 2), at about the same scale.
        expected: What `shown` is like but for a smooth field, shape (m, 2); `points` if None.
        may_flip: Whether y may run the other way in the second picture.
    """
    listed = np.arange(len(points))
    best = given = PointOrder(listed, False, 0.0)
    extent = float(np.ptp(points, axis=0).max())
    if not 3 < len(points) <= MOST or extent == 0:
        return given
    field, base = _Field((points - points.mean(axis=0)) / extent), (points if expected is None else expected)
    as_given = float(field.likelihoods((shown - base)[None] / extent)[0])
    for flipped in (False, True) if may_flip else (False,):
        there = shown * (1.0, -1.0 if flipped else 1.0)
        apart = (base - base.mean(axis=0))[:, None] - (there - there.mean(axis=0))
        nearest = linear_sum_assignment((apart**2).sum(axis=2))[1]
        for start in (listed, listed[::-1], nearest):
            order, likelihood = field.improved(there / extent, base / extent, start)
            if likelihood - as_given > best.gain:
                best = PointOrder(order, flipped, likelihood - as_given)
    return best if best.gain > SURE else given


def likelihoods(first: FloatArray, seconds: FloatArray) -> FloatArray:
    """Logarithmic likelihoods of several second pictures, shape (n, m, 2), of points, shape (m, 2); (n,)."""
    extent = float(np.ptp(first, axis=0).max())
    return _Field((first - first.mean(axis=0)) / extent).likelihoods((seconds - first) / extent)


def astray(points: FloatArray, shown: FloatArray) -> int | None:
    """Number of the one point that `shown` has where no smooth field moves it; None if there is none.

    Compared are the field with one point left out, which may be anywhere in the square of the points' extent,
    and that of all. Arguments as of `likeliest_order`.
    """
    extent, count = float(np.ptp(points, axis=0).max()), len(points)
    if not 3 < count <= MOST or extent == 0:
        return None
    places, moved = points / extent - points.mean(axis=0) / extent, (shown - points)[None] / extent
    together = _Field(places).likelihoods(moved)[0]
    without = [
        _Field(np.delete(places, each, axis=0)).likelihoods(np.delete(moved, each, axis=1))[0]
        for each in range(count)
    ]
    lead = max(without) - together + np.log(2 * np.pi / count)  # likelihoods leave out 2 pi
    return int(np.argmax(without)) if lead > ODD else None


def order_text(order: IntArray, names: Sequence[str]) -> str:
    """A clause on an order, with the points' names."""
    changed = np.flatnonzero(order != np.arange(len(order)))
    if len(changed) == 2:
        return f"with {names[changed[0]]} and {names[changed[1]]} exchanged"
    if len(order) and (order == np.arange(len(order))[::-1]).all():
        return "in reverse"
    return f"in the order {' '.join(names[each] for each in order)}"


class _Field:
    """Likelihoods of displacements of points, shape (m, 2), for every size of the field and of the errors."""

    def __init__(self, points: FloatArray) -> None:
        self.points = points
        apart = ((points[:, None] - points) ** 2).sum(axis=2)
        smooth = np.kron(np.eye(2), np.exp(-apart / (2 * SMOOTH**2)))
        x, y = points.T
        moves = np.array([np.r_[-y, x], np.r_[x, y], np.r_[0 * x + 1, 0 * y], np.r_[0 * x, 0 * y + 1]])
        known = np.array([np.radians(FREE.turn), FREE.scale, 10.0, 10.0])  # any shift
        frame = np.einsum("k,ki,kj->ij", known**2, moves, moves)
        covariances = [
            frame + size**2 * smooth + error**2 * np.eye(len(frame)) for size in SIZES for error in ERRORS
        ]
        self._precisions = np.linalg.inv(covariances)
        self._determinants = np.linalg.slogdet(covariances)[1]

    def likelihoods(self, displacements: FloatArray) -> FloatArray:
        """Largest logarithmic likelihood of each of some displacements, shape (n, m, 2); shape (n,)."""
        values = displacements.transpose(0, 2, 1).reshape(len(displacements), -1)
        squares = ((values @ self._precisions) * values).sum(axis=2)
        return np.asarray(-0.5 * (squares + self._determinants[:, None]).min(axis=0))

    def improved(self, there: FloatArray, base: FloatArray, order: IntArray) -> tuple[IntArray, float]:
        """The order after exchanges of two points as long as they make it likelier, and its likelihood."""
        one, other = np.triu_indices(len(order), 1)
        trial = np.tile(order, (len(one) + 1, 1))
        while True:
            rows = np.arange(len(one))
            trial[:] = order
            trial[rows, one], trial[rows, other] = order[other], order[one]
            found = self.likelihoods(there[trial] - base)  # the last is without an exchange
            if not found.max() - found[-1] > GAINED * (1 + abs(found[-1])):  # or it would turn in circles
                return order, float(found[-1])
            order = trial[found.argmax()].copy()

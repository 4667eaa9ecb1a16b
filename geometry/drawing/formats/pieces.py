"""Pieces of curves as readers find them: lines and arcs, with other curves replaced by arcs."""

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pinnray.runtime.arrays import FloatArray

DEVIATION = 1e-3
"""Largest distance of the arcs from the ellipse or spline for which they stand, mm."""

HALF_CIRCLE = 1 + 1e-9
"""Largest bulge of an arc that stands for a part of a curve."""

PROBES = np.linspace(0, 1, 17)[1:-1]

FARTHEST = 1e7
"""Largest coordinate, mm. Farther away rounding is no longer far below `DEVIATION`."""

Curve = Callable[[FloatArray], FloatArray]
"""Points (n, 2) of a curve at parameters (n,)."""


class Piece(NamedTuple):
    """A line or an arc, mm."""

    start: FloatArray  # (2,)
    end: FloatArray  # (2,)
    bulge: float  # tangent of a quarter of the arc's angle, positive to the left; zero for a line
    label: str  # name of the layer, group, part or physical group; empty without one


def line(start: ArrayLike, end: ArrayLike, label: str) -> Piece:
    """A straight piece."""
    return Piece(np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64), 0.0, label)


def arcs_along(curve: Curve, first: float, last: float, label: str) -> Iterator[Piece]:
    """Arcs through three points of a curve each, halved until none is more than `DEVIATION` off.

    An arc of a circle is exact, of at most half of it. A curve beyond `FARTHEST` gives one line to a point
    out there, which the reader refuses.

    Args:
        curve: The curve, mm.
        first: Parameter of its start.
        last: Parameter of its end.
        label: Label of the pieces.
    """
    with np.errstate(all="ignore"):  # of what has no finite coordinates
        ends = curve(np.array([first, last]))
        between = curve(first + PROBES * (last - first))
    for point in (*ends, *between):
        if not is_near(point):
            yield line(ends[0], point, label)
            return
    closed = bool(np.linalg.norm(ends[1] - ends[0]) < 1e-9 * max(1.0, float(np.abs(ends).max())))
    cuts = np.linspace(first, last, 3 if closed else 2)
    for start, end in pairwise(cuts.tolist()):
        yield from _halved(curve, start, end, label, 0)


def is_near(points: FloatArray) -> bool:
    """Whether all coordinates are finite and at most `FARTHEST`, mm."""
    return bool((np.abs(points) <= FARTHEST).all())


def _halved(curve: Curve, first: float, last: float, label: str, level: int) -> Iterator[Piece]:
    half = 0.5 * (first + last)
    start, middle, end = curve(np.array([first, half, last]))
    bulge = _bulge(start, middle, end)
    off = _deviation(start, end, bulge, curve(first + PROBES * (last - first)))
    if abs(bulge) < HALF_CIRCLE and off <= 0.8 * DEVIATION:
        yield Piece(start, end, bulge, label)
    elif level == 24:  # halvings
        yield line(start, end, label)
    else:
        yield from _halved(curve, first, half, label, level + 1)
        yield from _halved(curve, half, last, label, level + 1)


def _bulge(start: FloatArray, middle: FloatArray, end: FloatArray) -> float:
    """Bulge of the arc from `start` to `end` through `middle`: by the angle at which it sees the chord."""
    to_start, to_end = start - middle, end - middle
    cross = float(to_start[0] * to_end[1] - to_start[1] * to_end[0])
    half = np.arctan2(-cross, -float(to_start @ to_end))  # half the arc's angle: zero for a straight line
    return float(np.tan(half / 2)) if cross else 0.0


def _deviation(start: FloatArray, end: FloatArray, bulge: float, points: FloatArray) -> float:
    """Largest distance of points (n, 2) from the circle or line of an arc."""
    chord = end - start
    length = float(np.linalg.norm(chord))
    if length == 0:
        return float(np.linalg.norm(points - start, axis=1).max())
    left = np.array([-chord[1], chord[0]]) / length
    away = points - 0.5 * (start + end)
    if abs(bulge) < 1e-9:
        return float(np.abs(away @ left).max())
    height = (1 - bulge**2) / (4 * bulge) * length
    radius = (1 + bulge**2) / (4 * abs(bulge)) * length
    return float(np.abs(np.linalg.norm(away - height * left, axis=1) - radius).max())

"""A closed curve of straight lines and circular arcs."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray, frozen_array
from pinnray.runtime.errors import ShapeError, UserError
from pinnray.runtime.notebook import brief

STRAIGHT = 1e-12
"""Largest absolute bulge of a straight piece."""


@dataclass(frozen=True, eq=False)
class Loop:
    """A closed curve: piece i runs from corner i to the next one, straight or along a circular arc.

    Attributes:
        points: Corners, shape (n, 2), mm.
        bulges: Tangent of a quarter of each arc's angle, shape (n,): positive to the left, as in DXF; zero
            for a straight line. An arc is less than a full circle.
        names: Name of each piece, such as `base` or `front`; empty for a piece without one.

    Raises:
        ShapeError: If the three do not fit together.
        UserError: If a piece has no length or a number is not finite.
    """

    points: FloatArray
    bulges: FloatArray
    names: tuple[str, ...]

    __repr__ = brief

    def __post_init__(self) -> None:
        points = frozen_array(self.points, dtype=np.float64, shape=(None, 2), name="points")
        bulges = frozen_array(self.bulges, dtype=np.float64, shape=(len(points),), name="bulges")
        if len(self.names) != len(points):
            raise ShapeError(f"a loop of {len(points)} corners needs as many names, got {len(self.names)}")
        if not (np.isfinite(points).all() and np.isfinite(bulges).all()):
            raise UserError("a closed curve has a coordinate that is not a finite number")
        if len(points) < 2 or (_following(points) == points).all(axis=1).any():
            raise UserError("a closed curve has a piece without length")
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "bulges", bulges)

    @classmethod
    def polygon(cls, corners: ArrayLike, names: Sequence[str] | None = None) -> Self:
        """The closed polygon through corners of shape (n, 2), mm."""
        points = np.asarray(corners, dtype=np.float64)
        return cls(points, np.zeros(len(points)), tuple(names or [""] * len(points)))

    @cached_property
    def ends(self) -> FloatArray:
        """Both ends of every piece, shape (n, 2, 2), mm."""
        return np.stack([self.points, _following(self.points)], axis=1)

    @property
    def straight(self) -> IntArray:
        """Numbers of the straight pieces."""
        return np.flatnonzero(np.abs(self.bulges) <= STRAIGHT)

    @cached_property
    def lengths(self) -> FloatArray:
        """Length of every piece, shape (n,), mm."""
        chords = np.linalg.norm(self.ends[:, 1] - self.ends[:, 0], axis=1)
        angle = 2 * np.arctan(np.abs(self.bulges))  # half the arc's angle
        return np.asarray(chords * np.divide(angle, np.sin(angle), out=np.ones_like(angle), where=angle > 0))

    @cached_property
    def area(self) -> float:
        """Enclosed area, mm^2; negative for a clockwise curve."""
        start, end = self.ends[:, 0], self.ends[:, 1]
        origin = self.points[0]
        a, b = start - origin, end - origin
        polygon = float(0.5 * cross(a, b).sum())
        if not self.bulges.any():
            return polygon
        return float(polygon + (((end - start) ** 2).sum(axis=1) / 8 * _segment(self.bulges)).sum())

    @property
    def bounds(self) -> FloatArray:
        """Smallest and largest x and y, shape (2, 2), mm."""
        extremes = [self.points]
        for which in np.flatnonzero(np.abs(self.bulges) > STRAIGHT):
            centre, radius = self.circle(int(which))
            around = centre + radius * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]], dtype=np.float64)
            extremes.append(around[self.beside_arc(int(which), around)])
        points = np.concatenate(extremes)
        return np.stack([points.min(axis=0), points.max(axis=0)])

    def circle(self, which: int) -> tuple[FloatArray, float]:
        """Centre, shape (2,), mm, and radius, mm, of the arc `which`."""
        start, end = self.ends[which]
        bulge = float(self.bulges[which])
        left = np.array([start[1] - end[1], end[0] - start[0]])
        centre = 0.5 * (start + end) + left * (1 - bulge**2) / (4 * bulge)
        return centre, float(np.linalg.norm(start - centre))

    def along(self, which: int, fractions: ArrayLike) -> FloatArray:
        """Points at fractions (k,) of the length of piece `which`, shape (k, 2), mm."""
        share = np.atleast_1d(np.asarray(fractions, dtype=np.float64))
        start, end = self.ends[which]
        if abs(self.bulges[which]) <= STRAIGHT:
            return np.asarray(start + share[:, None] * (end - start))
        centre, _ = self.circle(which)
        angles = share * 4 * np.arctan(self.bulges[which])
        (x, y), cosine, sine = start - centre, np.cos(angles), np.sin(angles)
        points = np.asarray(centre + np.stack([x * cosine - y * sine, x * sine + y * cosine], axis=1))
        points[share == 0], points[share == 1] = start, end
        return points

    def places(self, points: FloatArray) -> "Places":
        """The places on the curve that are nearest to k points, (k, 2), mm."""
        found = Places(
            np.zeros(len(points), dtype=np.int64), np.zeros(len(points)), np.full(len(points), np.inf)
        )
        for which, (start, end) in enumerate(self.ends):
            if abs(self.bulges[which]) <= STRAIGHT:
                along = end - start
                share = (points - start) @ along / (along @ along)
            else:
                centre, _ = self.circle(which)
                sweep = 4 * np.arctan(self.bulges[which])
                (x, y), around = start - centre, points - centre
                turned = np.arctan2(x * around[:, 1] - y * around[:, 0], around @ (x, y)) * np.sign(sweep)
                middle = 0.5 * abs(sweep)
                share = ((turned - middle + np.pi) % (2 * np.pi) - np.pi + middle) / abs(sweep)
            share = share.clip(0, 1)
            away = np.linalg.norm(self.along(which, share) - points, axis=1)
            nearer = away < found.distances - 1e-12
            for values, better in zip(found, (np.full(len(points), which), share, away), strict=True):
                values[nearer] = better[nearer]
        return found

    def flattened(self, deviation: float = 1e-3) -> FloatArray:
        """Corners, shape (k, 2), mm, of a polygon within `deviation`, mm, of the curve, on which they lie."""
        points = []
        for which in range(len(self.points)):
            count = 1
            if abs(self.bulges[which]) > STRAIGHT:
                _, radius = self.circle(which)
                step = 2 * np.arccos(max(1 - deviation / radius, 0.5))
                count = max(int(np.ceil(abs(4 * np.arctan(self.bulges[which])) / step)), 2)
            points.append(self.along(which, np.arange(count) / count))
        return np.concatenate(points)

    def reversed(self) -> Self:
        """The same curve in the other direction."""
        names = (*self.names[-2::-1], self.names[-1])
        return type(self)(self.points[::-1], -_following(self.bulges[::-1]), names)

    def transformed(self, matrix: ArrayLike, shift: ArrayLike = (0.0, 0.0)) -> Self:
        """The curve under x -> matrix x + shift, with a matrix of a rotation or reflection times a scale.

        A reflection keeps the order of the corners, so that a counter-clockwise curve becomes clockwise.
        """
        turn = np.asarray(matrix, dtype=np.float64)
        sign = np.sign(np.linalg.det(turn))
        return type(self)(self.points @ turn.T + np.asarray(shift), sign * self.bulges, self.names)

    def renamed(self, names: Iterable[str]) -> Self:
        """The curve with other names of its pieces."""
        return type(self)(self.points, self.bulges, tuple(names))

    def named(self, which: int, name: str) -> Self:
        """The curve with another name of one piece."""
        return self.renamed((*self.names[:which], name, *self.names[which + 1 :]))

    def split(self, which: int, fractions: Sequence[float]) -> Self:
        """The curve with piece `which` cut at fractions of its length, between 0 and 1 and rising."""
        shares = np.diff([0.0, *fractions, 1.0])
        quarter = np.arctan(self.bulges[which])
        return type(self)(
            np.insert(self.points, which + 1, self.along(which, fractions), axis=0),
            np.concatenate([self.bulges[:which], np.tan(quarter * shares), self.bulges[which + 1 :]]),
            (*self.names[:which], *[self.names[which]] * len(shares), *self.names[which + 1 :]),
        )

    def pieces(self, name: str) -> Iterator[int]:
        """Numbers of the pieces with a name."""
        return (which for which, own in enumerate(self.names) if own == name)

    def runs(self, chosen: Iterable[int]) -> list[list[int]]:
        """Some pieces as runs of neighbours, each in the curve's direction."""
        count, left = len(self.points), set(chosen)
        runs = []
        for start in sorted(which for which in left if (which - 1) % count not in left) or [min(left)]:
            run = [start]
            while (following := (run[-1] + 1) % count) in left and following != start:
                run.append(following)
            runs.append(run)
        return runs

    def place_in(self, run: Sequence[int], along: float) -> tuple[int, float]:
        """The piece, and the fraction of its length, at an arc length, mm, from the start of a run."""
        ends = np.cumsum(self.lengths[list(run)])
        step = int(np.searchsorted(ends, along))
        return run[step], float(1 - (ends[step] - along) / self.lengths[run[step]])

    def beside_arc(self, which: int, points: FloatArray) -> BoolArray:
        """Mask of the points (k, 2), mm, beyond the chord of arc `which`, on the side of the arc."""
        start, end = self.ends[which]
        along, away = end - start, points - start
        right = along[1] * away[:, 0] - along[0] * away[:, 1]
        return np.asarray(np.sign(self.bulges[which]) * right >= -1e-9 * float(along @ along))


class Places(NamedTuple):
    """Places on a curve, k of them."""

    pieces: IntArray  # (k,)
    shares: FloatArray  # fractions of the pieces' lengths, (k,)
    distances: FloatArray  # of the points to which they are nearest, (k,), mm


def cross(first: FloatArray, second: FloatArray) -> FloatArray:
    """Cross products of plane vectors, shape (..., 2) each."""
    return np.asarray(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])


def turns(first: FloatArray, second: FloatArray) -> FloatArray:
    """Angles from plane vectors to others, shape (..., 2) each, radians, positive to the left."""
    return np.asarray(np.arctan2(cross(first, second), (first * second).sum(axis=-1)))


def _following(values: FloatArray) -> FloatArray:
    """The value of the next corner for every corner, shape (n, ...)."""
    return np.concatenate([values[1:], values[:1]])


def _segment(bulges: FloatArray) -> FloatArray:
    """Area between chord and arc over an eighth of the chord squared: (θ - sin θ) / sin²(θ/2)."""
    angle = 4 * np.arctan(bulges)
    flat = np.abs(bulges) < 1e-3  # where the difference cancels: 8 b / 3 (1 + b² / 5 ...)
    with np.errstate(invalid="ignore", divide="ignore"):
        exact = (angle - np.sin(angle)) / np.sin(angle / 2) ** 2
    series = 8 * bulges / 3 * (1 + bulges**2 / 5)
    return np.asarray(np.where(flat, series, exact))

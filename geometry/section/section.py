"""The section of a body: an outline and cavities, with what can be asked of them in closed form."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
import shapely
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from pinnray.geometry.section.loop import Loop
from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.runtime.content_hash import content_hash
from pinnray.runtime.errors import UserError
from pinnray.runtime.notebook import brief

DEVIATION = 1e-5
"""Largest distance of the polygon from the arcs for which it stands, mm."""


@dataclass(frozen=True, eq=False)
class Section:
    """A plane body between an outline and cavities; the body is on the left of every curve.

    The outline's pieces `base` are clamped and its pieces `front` face the indenter: x falls along them.
    Other names are free.

    Raises:
        UserError: If a curve runs the wrong way round.
    """

    outline: Loop  # counter-clockwise
    cavities: tuple[Loop, ...] = ()  # clockwise

    __repr__ = brief

    def __post_init__(self) -> None:
        if self.outline.area <= 0 or any(cavity.area >= 0 for cavity in self.cavities):
            raise UserError("an outline runs counter-clockwise and a cavity clockwise; one of them does not")

    @property
    def loops(self) -> tuple[Loop, ...]:
        """The outline and the cavities."""
        return (self.outline, *self.cavities)

    @cached_property
    def area(self) -> float:
        """Area of the body, mm^2."""
        return sum(loop.area for loop in self.loops)

    @cached_property
    def bounds(self) -> FloatArray:
        """Smallest and largest x and y, shape (2, 2), mm."""
        return self.outline.bounds

    @cached_property
    def digest(self) -> str:
        """SHA-256 over every curve and name, in hexadecimal; equal for equal sections."""
        return content_hash([[loop.points, loop.bulges, list(loop.names)] for loop in self.loops])

    @cached_property
    def polygon(self) -> shapely.Polygon:
        """The body as a polygon, within `DEVIATION` of the arcs."""
        rings = [loop.flattened(DEVIATION) for loop in self.loops]
        return shapely.Polygon(rings[0], rings[1:])

    def contains(self, points: ArrayLike) -> BoolArray:
        """Mask of the points, shape (n, 2), mm, in the body or within 0.1 micrometre of it."""
        return np.asarray(self.clearance(points) >= -1e-4)

    def clearance(self, points: ArrayLike) -> FloatArray:
        """Distance of points (n, 2), mm, from the nearest boundary, (n,), mm; negative outside the body."""
        places = shapely.points(np.asarray(points, dtype=np.float64).reshape(-1, 2))
        distance = shapely.distance(self.polygon.boundary, places)
        inside = shapely.contains_xy(self.polygon, shapely.get_x(places), shapely.get_y(places))
        return np.asarray(np.where(inside, distance, -distance), dtype=np.float64)

    def named(self, name: str) -> Iterator[tuple[Loop, int]]:
        """Every piece with a name, as its loop and its number in it."""
        for loop in self.loops:
            for which in loop.pieces(name):
                yield loop, which

    def front_place(self, x: float) -> tuple[int, float]:
        """The piece of the outline, and the fraction of its length, at an abscissa of the front.

        Raises:
            UserError: If the front has no such abscissa.
        """
        reach = []
        for which in self.outline.pieces("front"):
            left, right = sorted(self.outline.ends[which][:, 0])
            if left - 1e-9 <= x <= right + 1e-9:
                return which, _fraction_at(self.outline, which, x)
            reach += [left, right]
        if not reach:
            raise UserError("the section has no piece called front, which faces the indenter")
        raise UserError(
            f"x = {x:.6g} mm is not on the front face, which runs from {min(reach):.6g} to "
            f"{max(reach):.6g} mm"
        )

    def front_point(self, x: float) -> FloatArray:
        """The point of the front at an abscissa, shape (2,), mm.

        Raises:
            UserError: If the front has no such abscissa.
        """
        which, fraction = self.front_place(x)
        return np.array([x, self.outline.along(which, fraction)[0, 1]])

    def transformed(self, matrix: ArrayLike, shift: ArrayLike = (0.0, 0.0)) -> Self:
        """The section under x -> matrix x + shift; the matrix is a scaled rotation or reflection."""
        loops = [loop.transformed(matrix, shift) for loop in self.loops]
        if np.linalg.det(np.asarray(matrix, dtype=np.float64)) < 0:
            loops = [loop.reversed() for loop in loops]
        return type(self)(loops[0], tuple(loops[1:]))


def _fraction_at(loop: Loop, which: int, x: float) -> float:
    """Fraction of the length of a piece, on which x falls or rises throughout, at an abscissa."""
    start, end = loop.ends[which, :, 0]
    share = np.clip((x - start) / (end - start), 0.0, 1.0)
    if which in loop.straight or share in (0, 1):
        return float(share)
    return float(brentq(lambda along: loop.along(which, along)[0, 0] - x, 0.0, 1.0, xtol=1e-15))

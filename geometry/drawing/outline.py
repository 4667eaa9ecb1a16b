"""Names parts of an outline: the clamp, the front around the contact, the back wall."""

from collections.abc import Iterable, Sequence

import numpy as np

from geometry.arrays import FloatArray
from geometry.drawing.formats.chain import corner_at, cut_at, nearest_piece, run_between
from geometry.drawing.formats.drawing import place
from geometry.errors import UserError
from geometry.section.loop import STRAIGHT, Loop
from geometry.section.thickness import inner_normals

ON_BOUNDARY = 0.1
"""Largest distance of a given point from the boundary, mm."""

STEEPEST = np.radians(60)
"""Largest angle of the front's normal from the contact's."""


def renamed(loop: Loop, names: Iterable[str]) -> Loop:
    """The curve with other names."""
    return Loop(loop.points, loop.bulges, tuple(names))


def with_part(loop: Loop, ends: Sequence[FloatArray], name: str) -> Loop:
    """The curve with a name for its part between two points, the shorter way, mm.

    Raises:
        UserError: If a point is not on the curve, or both are the same.
    """
    for point in ends:
        which, fraction = on_curve(loop, point, name)
        loop = cut_at(loop, which, fraction)
    first, last = (corner_at(loop, point) for point in ends)
    if first == last:
        raise UserError(
            f"the {name} at {place(ends[0])} has no length; give two different points of the outline"
        )
    ways = [run_between(first, last, len(loop.points)), run_between(last, first, len(loop.points))]
    shorter = min(ways, key=lambda way: float(loop.lengths[way].sum()))
    return renamed(loop, (name if which in shorter else own for which, own in enumerate(loop.names)))


def on_curve(loop: Loop, point: FloatArray, name: str) -> tuple[int, float]:
    """Piece and fraction of its length at a given point of the outline.

    Raises:
        UserError: If the point is farther than `ON_BOUNDARY` from the curve.
    """
    _, which, fraction, distance = nearest_piece([loop], point)
    if distance > ON_BOUNDARY:
        nearest = loop.along(which, fraction)[0]
        raise UserError(
            f"the {name} at {place(point)} is {distance:.3g} mm off the outline; its nearest point is "
            f"{place(nearest)}"
        )
    return which, fraction


def with_front(loop: Loop, contact: FloatArray) -> Loop:
    """The outline with its pieces `front`: the part around the contact whose normals are near +y.

    Normals of up to `STEEPEST` from +y count, so that x falls along the part; arcs are cut there. It ends
    at a clamped piece.
    """
    _, which, _, _ = nearest_piece([loop], contact)
    for step in (1, -1):
        current = which
        for _ in range(len(loop.points)):
            cuts = _crossings(loop, current)
            if cuts:
                loop = loop.split(current, cuts)
                break
            following = (current + step) % len(loop.points)
            if not _faces(loop, current) or loop.names[following] == "base":
                break
            current = following
        _, which, _, _ = nearest_piece([loop], contact)
    run = {which}
    for step in (1, -1):
        current = (which + step) % len(loop.points)
        while loop.names[current] != "base" and _faces(loop, current) and current not in run:
            run.add(current)
            current = (current + step) % len(loop.points)
    return renamed(loop, ("front" if number in run else own for number, own in enumerate(loop.names)))


def with_back(loop: Loop) -> Loop:
    """The outline with the name `back` for its longest straight piece opposite to the front, if long."""
    front = [loop.ends[which][:, 0] for which in loop.pieces("front")]
    reach = np.ptp(np.concatenate(front))
    free = [
        which
        for which in loop.straight.tolist()
        if loop.names[which] == ""
        and inner_normals(loop, which, 0.5)[0, 1] > 0.5
        and loop.lengths[which] > 0.5 * reach
    ]
    return loop.named(max(free, key=lambda which: loop.lengths[which]), "back") if free else loop


def base_start(loop: Loop) -> FloatArray:
    """The first corner of the base after the front, shape (2,), mm."""
    front = list(loop.pieces("front"))
    count = len(loop.points)
    last = next(which for which in front if (which + 1) % count not in front)
    order = [(last + 1 + step) % count for step in range(count)]
    return np.asarray(loop.points[next(which for which in order if loop.names[which] == "base")])


def _slopes(loop: Loop, which: int) -> tuple[float, float]:
    """Angles of the outer normal from +y at both ends of a piece, the first within half a turn."""
    x, y = -inner_normals(loop, which, 0.0)[0]
    first = float(np.arctan2(-x, y))
    return first, first + 4 * float(np.arctan(loop.bulges[which]))


def _faces(loop: Loop, which: int) -> bool:
    return all(abs(angle) <= STEEPEST + 1e-9 for angle in _slopes(loop, which))


def _crossings(loop: Loop, which: int) -> list[float]:
    """Fractions of an arc's length at which its normal is `STEEPEST` from +y."""
    if abs(loop.bulges[which]) <= STRAIGHT:
        return []
    first, last = _slopes(loop, which)
    turns = 2 * np.pi * np.array([-1, 0, 1])
    limits = np.concatenate([turns + STEEPEST, turns - STEEPEST])
    fractions = (limits - first) / (last - first)
    return sorted(float(share) for share in fractions if 1e-6 < share < 1 - 1e-6)

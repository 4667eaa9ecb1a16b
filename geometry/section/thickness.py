"""Local wall thickness: the way through the material from one boundary to the facing one."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pinnray.geometry.section.loop import STRAIGHT, Loop, cross, turns
from pinnray.geometry.section.section import Section
from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray

TOUCH = 1e-7
"""Length of a ray within which it is still at its own start, mm."""


class Crossing(NamedTuple):
    """Where rays through the material end."""

    lengths: FloatArray  # up to the first boundary, shape (n,), mm; infinite for a ray that meets none
    pieces: IntArray  # number of the piece that is met among those of all loops, shape (n,)


def wall_thickness(section: Section, spacing: float) -> tuple[FloatArray, FloatArray]:
    """Thickness of the walls along the whole boundary, by rays along the inner normals.

    A ray that ends on the piece beyond a sharp corner (90 degrees or less) measures no wall: toward the apex
    of a wedge its length vanishes whatever the wedge. Such points are left out.

    Args:
        section: The body.
        spacing: Largest distance of neighbouring points on a piece, mm; every piece has at least one.

    Returns:
        Points of the boundary, shape (n, 2), mm, and the thickness there, shape (n,), mm; both empty for a
        triangle without cavities.
    """
    return _widths(section.loops, spacing)


def cavity_widths(section: Section, spacing: float) -> tuple[FloatArray, FloatArray]:
    """Clear widths of the cavities along their boundaries, by rays into the cavity; see `wall_thickness`.

    Returns:
        Points of the cavities' boundaries, shape (n, 2), mm, and the width there, shape (n,), mm.
    """
    if not section.cavities:
        return np.empty((0, 2)), np.empty(0)
    return _widths([cavity.reversed() for cavity in section.cavities], spacing)


def inner_normals(loop: Loop, which: int, fractions: ArrayLike) -> FloatArray:
    """Unit vectors to the left of piece `which`, into the body, at fractions (k,) of its length: (k, 2)."""
    share = np.atleast_1d(np.asarray(fractions, dtype=np.float64))
    along = loop.ends[which, 1] - loop.ends[which, 0]
    angle = np.arctan2(along[1], along[0]) + (2 * share - 1) * 2 * np.arctan(loop.bulges[which])
    return np.stack([-np.sin(angle), np.cos(angle)], axis=1)


def corner_turns(loop: Loop) -> FloatArray:
    """Turns of a curve at its corners, shape (n,), radians, positive to the left."""
    normals = np.array([inner_normals(loop, which, [0.0, 1.0]) for which in range(len(loop.points))])
    return turns(np.roll(normals[:, 1], 1, axis=0), normals[:, 0])


def through(section: Section, points: ArrayLike, directions: ArrayLike) -> Crossing:
    """Rays from points (n, 2), mm, along unit vectors (n, 2), to the first boundary ahead."""
    start, ahead = (np.asarray(each, dtype=np.float64).reshape(-1, 2) for each in (points, directions))
    return _through(_Pieces.of(section.loops), start, ahead)


class _Pieces(NamedTuple):
    """Pieces of closed curves, p in all."""

    start: FloatArray  # (p, 2), mm
    end: FloatArray  # (p, 2), mm
    bulges: FloatArray  # (p,)
    centres: FloatArray  # of the arcs, (p, 2), mm; not a number for a straight piece
    radii: FloatArray  # (p,), mm
    following: IntArray  # number of the next piece of the curve, (p,)

    @classmethod
    def of(cls, loops: Sequence[Loop]) -> "_Pieces":
        """The pieces of curves."""
        ends = np.concatenate([loop.ends for loop in loops])
        bulges = np.concatenate([loop.bulges for loop in loops])
        start, end = ends[:, 0], ends[:, 1]
        safe = np.where(np.abs(bulges) > STRAIGHT, bulges, np.nan)
        left = np.stack([start[:, 1] - end[:, 1], end[:, 0] - start[:, 0]], axis=1)
        centres = 0.5 * (start + end) + left * ((1 - safe**2) / (4 * safe))[:, None]
        last = np.cumsum([len(loop.bulges) for loop in loops])
        following = np.arange(len(bulges)) + 1
        following[last - 1] = last - np.diff(last, prepend=0)
        return cls(start, end, bulges, centres, np.linalg.norm(start - centres, axis=1), following)


def _widths(loops: Sequence[Loop], spacing: float) -> tuple[FloatArray, FloatArray]:
    """Lengths of the rays to the left of curves up to the next one of them."""
    pieces = _Pieces.of(loops)
    points, normals, own = _samples(loops, spacing)
    crossing = _through(pieces, points, normals)
    kept = np.isfinite(crossing.lengths) & ~_beyond_corner(pieces, own, crossing.pieces)
    return points[kept], crossing.lengths[kept]


def _samples(loops: Sequence[Loop], spacing: float) -> tuple[FloatArray, FloatArray, IntArray]:
    """Points (n, 2) on every piece, half of `spacing` from its ends, unit vectors to the left, and pieces."""
    points, normals, counts = [], [], []
    for loop in loops:
        for which, length in enumerate(loop.lengths):
            counts.append(max(int(np.ceil(length / spacing)), 1))
            share = (np.arange(counts[-1]) + 0.5) / counts[-1]
            points.append(loop.along(which, share))
            normals.append(inner_normals(loop, which, share))
    return np.concatenate(points), np.concatenate(normals), np.repeat(np.arange(len(counts)), counts)


def _through(pieces: _Pieces, start: FloatArray, ahead: FloatArray) -> Crossing:
    step = max(1_000_000 // len(pieces.bulges), 1)  # pairs of a ray and a piece in memory
    found = [
        _first(pieces, start[first : first + step], ahead[first : first + step])
        for first in range(0, max(len(start), 1), step)
    ]
    return Crossing(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def _first(pieces: _Pieces, start: FloatArray, ahead: FloatArray) -> Crossing:
    is_curved = np.abs(pieces.bulges) > STRAIGHT
    straight, curved = np.flatnonzero(~is_curved), np.flatnonzero(is_curved)
    lengths = np.empty((len(start), len(pieces.bulges)))
    lengths[:, straight] = _to_lines(pieces.start[straight], pieces.end[straight], start, ahead)
    lengths[:, curved] = _to_arcs(pieces, curved, start, ahead)
    nearest = lengths.argmin(axis=1)
    return Crossing(lengths[np.arange(len(start)), nearest], nearest)


def _to_lines(first: FloatArray, last: FloatArray, start: FloatArray, ahead: FloatArray) -> FloatArray:
    """Lengths of rays (n, 2) to straight pieces (p, 2), shape (n, p), mm; infinite where they miss."""
    side, right = last - first, np.stack([ahead[:, 1], -ahead[:, 0]], axis=1)
    right_of_side = np.stack([side[:, 1], -side[:, 0]])
    across = ahead @ right_of_side
    with np.errstate(divide="ignore", invalid="ignore"):
        length = ((first * right_of_side.T).sum(axis=1) - start @ right_of_side) / across
        share = (right @ first.T - (start * right).sum(axis=1)[:, None]) / across
    slack = 1e-9 / np.linalg.norm(side, axis=1)
    hit = (length > TOUCH) & (np.abs(share - 0.5) <= 0.5 + slack)
    return np.asarray(np.where(hit, length, np.inf))


def _to_arcs(pieces: _Pieces, curved: IntArray, start: FloatArray, ahead: FloatArray) -> FloatArray:
    """Lengths of rays (n, 2) to the curved pieces (p,), shape (n, p), mm; infinite where they miss."""
    first, last, radii = pieces.start[curved], pieces.end[curved], pieces.radii[curved]
    apart = start[:, None] - pieces.centres[curved]
    middle = -(apart * ahead[:, None]).sum(axis=-1)
    with np.errstate(invalid="ignore"):  # a ray that misses the circle
        half = np.sqrt(middle**2 - (apart**2).sum(axis=-1) + radii**2)
    best = np.full(middle.shape, np.inf)
    for length in (middle - half, middle + half):
        away = start[:, None] + length[..., None] * ahead[:, None] - first
        beyond = -np.sign(pieces.bulges[curved]) * cross(last - first, away)
        hit = (length > TOUCH) & (beyond >= -1e-9 * radii)
        best = np.where(hit & (length < best), length, best)
    return best


def _beyond_corner(pieces: _Pieces, own: IntArray, met: IntArray) -> BoolArray:
    """Mask of rays from pieces (n,) that meet the piece next to it (n,), beyond a corner of 90 degrees."""
    sides, turn = pieces.end - pieces.start, 2 * np.arctan(pieces.bulges)
    angle = np.arctan2(sides[:, 1], sides[:, 0])
    bend = (angle - turn)[pieces.following] - (angle + turn)
    sharp = (bend + np.pi) % (2 * np.pi) - np.pi >= np.pi / 2 - 1e-9
    previous = np.argsort(pieces.following)
    ahead = (met == pieces.following[own]) & sharp[own]
    behind = (met == previous[own]) & sharp[previous[own]]
    return np.asarray(ahead | behind)

"""Local wall thickness: the way through the material from one boundary to the facing one."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from geometry.arrays import BoolArray, FloatArray, IntArray
from geometry.section.loop import STRAIGHT, Loop
from geometry.section.section import Section

TOUCH = 1e-7
"""Length of a ray within which it is still at its own start, mm."""

AT_ONCE = 1_000_000
"""Largest number of pairs of a ray and a piece in memory."""


class Samples(NamedTuple):
    """Points along the boundary of a section.

    Attributes:
        points: Shape (n, 2), mm.
        normals: Unit vectors into the body, shape (n, 2).
        pieces: Number of each point's piece among those of all loops, shape (n,).
        fractions: Place on the piece as a fraction of its length, shape (n,).
    """

    points: FloatArray
    normals: FloatArray
    pieces: IntArray
    fractions: FloatArray


class Crossing(NamedTuple):
    """Rays through the material.

    Attributes:
        lengths: Up to the first boundary, shape (n,), mm; infinite for a ray that meets none.
        pieces: Number of the piece that is met among those of all loops, shape (n,).
    """

    lengths: FloatArray
    pieces: IntArray


def wall_thickness(
    section: Section, spacing: float, *, corners: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Thickness of the walls along the whole boundary, by rays along the inner normals.

    A ray that ends on the piece beyond a sharp corner (90 degrees or less) measures no wall: toward the apex
    of a wedge its length vanishes whatever the wedge. Such points are left out unless `corners`.

    Args:
        section: The body.
        spacing: Largest distance of neighbouring points on a piece, mm; every piece has at least one.
        corners: Whether to keep the points whose ray ends beyond a sharp corner.

    Returns:
        Points of the boundary, shape (n, 2), mm, and the thickness there, shape (n,), mm; both empty for a
        triangle without cavities.
    """
    return _widths(section.loops, spacing, corners=corners)


def cavity_widths(section: Section, spacing: float) -> tuple[FloatArray, FloatArray]:
    """Clear widths of the cavities along their boundaries, by rays into the cavity; see `wall_thickness`.

    Returns:
        Points of the cavities' boundaries, shape (n, 2), mm, and the width there, shape (n,), mm.
    """
    if not section.cavities:
        return np.empty((0, 2)), np.empty(0)
    if all(len(cavity.straight) == len(cavity.bulges) for cavity in section.cavities):
        return _widths([_Lines(each.ends[::-1, ::-1], each.bulges) for each in section.cavities], spacing)
    return _widths([_reversed(cavity) for cavity in section.cavities], spacing)


class _Lines(NamedTuple):
    """A closed curve of straight pieces: ends (p, 2, 2) and bulges (p,), without the checks of a `Loop`."""

    ends: FloatArray
    bulges: FloatArray


_Curves = Sequence[Loop] | Sequence[_Lines]


def _reversed(loop: Loop) -> Loop:
    """The same curve run the other way round, without names."""
    return Loop(loop.points[::-1], -np.roll(loop.bulges[::-1], -1), ("",) * len(loop.points))


def _widths(loops: _Curves, spacing: float, *, corners: bool = False) -> tuple[FloatArray, FloatArray]:
    """Lengths of the rays to the left of curves up to the next one of them."""
    pieces = _Pieces.of(loops)
    samples = _samples(loops, pieces, spacing)
    crossing = _through(pieces, samples.points, samples.normals)
    kept = np.isfinite(crossing.lengths)
    if not corners:
        counts = np.array([len(loop.bulges) for loop in loops])
        kept &= ~_beyond_corner(pieces, counts, samples, crossing.pieces)
    return samples.points[kept], crossing.lengths[kept]


def boundary_samples(section: Section, spacing: float) -> Samples:
    """Points on every piece of the section, at most `spacing` mm apart and half of that from its ends."""
    return _samples(section.loops, _Pieces.of(section.loops), spacing)


def _samples(loops: _Curves, pieces: "_Pieces", spacing: float) -> Samples:
    if (np.abs(pieces.bulges) <= STRAIGHT).all():
        return _samples_of_lines(pieces.start, pieces.end, spacing)
    return _samples_of_curves([loop for loop in loops if isinstance(loop, Loop)], spacing)


def _samples_of_lines(start: FloatArray, end: FloatArray, spacing: float) -> Samples:
    along = end - start
    lengths = np.hypot(*along.T)
    counts = np.maximum(np.ceil(lengths / spacing), 1).astype(int)
    which = np.repeat(np.arange(len(counts)), counts)
    share = (np.arange(len(which)) - (np.cumsum(counts) - counts)[which] + 0.5) / counts[which]
    left = np.stack([-along[:, 1], along[:, 0]], axis=1) / lengths[:, None]
    return Samples(start[which] + share[:, None] * along[which], left[which], which, share)


def _samples_of_curves(loops: Sequence[Loop], spacing: float) -> Samples:
    points, normals, pieces, fractions, number = [], [], [], [], 0
    for loop in loops:
        counts = np.maximum(np.ceil(loop.lengths / spacing), 1).astype(int)
        for which, count in enumerate(counts):
            share = (np.arange(count) + 0.5) / count
            points.append(loop.along(which, share))
            normals.append(inner_normals(loop, which, share))
            pieces.append(np.full(count, number + which))
            fractions.append(share)
        number += len(counts)
    return Samples(
        np.concatenate(points), np.concatenate(normals), np.concatenate(pieces), np.concatenate(fractions)
    )


def inner_normals(loop: Loop, which: int, fractions: ArrayLike) -> FloatArray:
    """Unit vectors to the left of piece `which`, into the body, at fractions (k,) of its length: (k, 2)."""
    share = np.atleast_1d(np.asarray(fractions, dtype=np.float64))
    along = loop.ends[which, 1] - loop.ends[which, 0]
    angle = np.arctan2(along[1], along[0]) + (2 * share - 1) * 2 * np.arctan(loop.bulges[which])
    return np.stack([-np.sin(angle), np.cos(angle)], axis=1)


def through(section: Section, points: ArrayLike, directions: ArrayLike) -> Crossing:
    """Rays from points (n, 2), mm, along unit vectors (n, 2), to the first boundary ahead."""
    start, ahead = (np.asarray(each, dtype=np.float64).reshape(-1, 2) for each in (points, directions))
    return _through(_Pieces.of(section.loops), start, ahead)


def _through(pieces: "_Pieces", start: FloatArray, ahead: FloatArray) -> Crossing:
    step = max(AT_ONCE // len(pieces.bulges), 1)
    found = [
        _first(pieces, start[first : first + step], ahead[first : first + step])
        for first in range(0, len(start), step)
    ]
    if not found:
        return Crossing(np.empty(0), np.empty(0, dtype=np.int64))
    return Crossing(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


class _Pieces(NamedTuple):
    """Pieces of all loops: ends (p, 2) each, bulges (p,); centres (p, 2) and radii (p,) of the arcs."""

    start: FloatArray
    end: FloatArray
    bulges: FloatArray
    centres: FloatArray
    radii: FloatArray

    @classmethod
    def of(cls, loops: _Curves) -> "_Pieces":
        ends = np.concatenate([loop.ends for loop in loops])
        bulges = np.concatenate([loop.bulges for loop in loops])
        start, end = ends[:, 0], ends[:, 1]
        safe = np.where(np.abs(bulges) > STRAIGHT, bulges, np.nan)
        left = np.stack([start[:, 1] - end[:, 1], end[:, 0] - start[:, 0]], axis=1)
        centres = 0.5 * (start + end) + left * ((1 - safe**2) / (4 * safe))[:, None]
        return cls(start, end, bulges, centres, np.linalg.norm(start - centres, axis=1))


def _first(pieces: _Pieces, start: FloatArray, ahead: FloatArray) -> Crossing:
    curved = np.flatnonzero(np.abs(pieces.bulges) > STRAIGHT)
    if len(curved):
        lengths = np.full((len(start), len(pieces.bulges)), np.inf)
        straight = np.setdiff1d(np.arange(len(pieces.bulges)), curved)
        lengths[:, straight] = _to_lines(pieces.start[straight], pieces.end[straight], start, ahead)
        lengths[:, curved] = _to_arcs(_Pieces(*(each[curved] for each in pieces)), start, ahead)
    else:
        lengths = _to_lines(pieces.start, pieces.end, start, ahead)
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


def _to_arcs(arcs: _Pieces, start: FloatArray, ahead: FloatArray) -> FloatArray:
    """Lengths of rays (n, 2) to p arcs, shape (n, p), mm; infinite where they miss."""
    apart = start[:, None] - arcs.centres
    middle = -(apart * ahead[:, None]).sum(axis=-1)
    with np.errstate(invalid="ignore"):  # a ray that misses the circle
        half = np.sqrt(middle**2 - (apart**2).sum(axis=-1) + arcs.radii**2)
    best = np.full(middle.shape, np.inf)
    for length in (middle - half, middle + half):
        away = start[:, None] + length[..., None] * ahead[:, None] - arcs.start
        beyond = -np.sign(arcs.bulges) * _cross(arcs.end - arcs.start, away)
        hit = (length > TOUCH) & (beyond >= -1e-9 * arcs.radii)
        best = np.where(hit & (length < best), length, best)
    return best


def _beyond_corner(pieces: _Pieces, counts: IntArray, samples: Samples, met: IntArray) -> BoolArray:
    """Mask of the samples whose ray ends on the next or previous piece, beyond a corner of 90 degrees.

    `counts` are the numbers of pieces of the closed curves, shape (k,).
    """
    following = np.arange(counts.sum()) + 1
    following[np.cumsum(counts) - 1] = np.cumsum(counts) - counts
    sides, turn = pieces.end - pieces.start, 2 * np.arctan(pieces.bulges)
    angle = np.arctan2(sides[:, 1], sides[:, 0])
    bend = (angle - turn)[following] - (angle + turn)
    sharp = (bend + np.pi) % (2 * np.pi) - np.pi >= np.pi / 2 - 1e-9
    previous = np.argsort(following)
    ahead = (met == following[samples.pieces]) & sharp[samples.pieces]
    behind = (met == previous[samples.pieces]) & sharp[previous[samples.pieces]]
    return np.asarray(ahead | behind)


def _cross(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.asarray(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])

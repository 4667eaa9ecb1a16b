"""Chains loose lines and arcs into closed curves by their ends, and sorts markers and contact from them."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
import shapely

from pinnray.geometry.drawing.formats.drawing import LABELS, Drawing, MarkerSize, Scale, place
from pinnray.geometry.drawing.formats.ends import JOIN, check_ends, check_extent, joined
from pinnray.geometry.drawing.formats.pieces import Piece
from pinnray.geometry.section.loop import STRAIGHT, Loop, cross
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError

ROUND = 0.02
"""Largest relative difference of the radii of a closed curve that is a circle, of arcs or short lines."""


class Closed(NamedTuple):
    """Closed curves, and in words the gaps that a tolerance closed in them."""

    loops: tuple[Loop, ...]
    note: str = ""


def assembled(
    pieces: Sequence[Piece],
    points: Mapping[str, Sequence[FloatArray]],
    scale: Scale,
    tolerance: float | None,
    note: str,
    **facts: Any,
) -> Drawing:
    """The drawing of a file with its curves closed, and its markers and contact sorted out.

    Args:
        pieces: Lines and arcs; those called markers form circles, of arcs or short lines.
        points: Points by label, (2,) each, mm; those called markers or contact count.
        scale: Unit of the file's coordinates.
        tolerance: Largest gap that is closed, mm; None means `JOIN`.
        note: How the file was read.
        facts: Further attributes of the drawing.

    Raises:
        UserError: If a curve does not close, or a marker is no circle.
    """
    check_extent(pieces, scale)  # in a wrong unit no marker would be a circle
    discs = _discs([piece for piece in pieces if piece.label == "markers"])
    size = MarkerSize.of(np.array([diameter for _, diameter in discs]))
    contacts = points.get("contact", ())
    if len(contacts) > 1:
        raise UserError(f"two points are called contact, {place(contacts[0])} and {place(contacts[1])}")
    rest = [piece for piece in pieces if piece.label != "markers"]
    closed = closed_loops(rest, frozenset(LABELS) - {"markers"}, scale, tolerance)  # which may lie on top
    return Drawing(
        loops=closed.loops,
        note=note + closed.note + size.note,
        markers=np.array([*points.get("markers", ()), *(centre for centre, _ in discs)]).reshape(-1, 2),
        marker_diameter=size.diameter,
        contact=contacts[0] if contacts else None,
        **facts,
    )


def _discs(pieces: Sequence[Piece]) -> list[tuple[FloatArray, float]]:
    """Centres (2,) and diameters, mm, of the circles that pieces form: circles of their areas."""
    found = list[tuple[FloatArray, float]]()
    no_circle = "the marker at {} is no circle; draw circles or points"
    try:
        loops = _chained(pieces, JOIN).loops
    except UserError:
        raise UserError(no_circle.format(place(pieces[0].start))) from None
    for loop in loops:
        shares = np.linspace(0, 1, 16, endpoint=False)
        points = np.concatenate([loop.along(which, shares) for which in range(len(loop.points))])
        centre = np.array(shapely.Polygon(points).centroid.coords[0])
        radii = np.linalg.norm(points - centre, axis=1)
        if np.ptp(radii) > ROUND * radii.max():
            raise UserError(no_circle.format(place(loop.points[0])))
        found.append((centre, 2 * float(np.sqrt(abs(loop.area) / np.pi))))
    return found


def closed_loops(
    pieces: Sequence[Piece],
    markings: frozenset[str] = frozenset(),
    scale: Scale = Scale(),  # noqa: B008
    tolerance: float | None = None,
) -> Closed:
    """Closed curves from pieces in any order and direction, mm.

    Pieces labelled as one of `markings` may be part of a curve, or lie on top of it and only name it.

    Args:
        pieces: Lines and arcs.
        markings: Labels of pieces that may lie on top.
        scale: Unit of the file's coordinates.
        tolerance: Largest gap between two ends that is closed, mm; None means `JOIN`.
    """
    check_extent(pieces, scale)
    reach = JOIN if tolerance is None else tolerance
    labels = sorted({piece.label for piece in pieces if piece.label in markings})
    for count in range(len(labels), 0, -1):
        for on_top in combinations(labels, count):
            if not (rest := [piece for piece in pieces if piece.label not in on_top]):
                continue  # they are all there is
            try:
                loops, note = _chained(rest, reach)
            except UserError:
                continue  # they are part of the boundary
            for mark in (piece for piece in pieces if piece.label in on_top):
                loops = _marked(loops, mark)
            return Closed(loops, note)
    return _chained(pieces, reach)


def straightened(loop: Loop, deviation: float = 1e-7) -> Loop:
    """The curve with straight pieces of one name joined where their corner is at most `deviation` mm off."""
    count = len(loop.points)
    kept = list(range(count))
    for corner in range(count):
        where = kept.index(corner)
        before, after = kept[where - 1], kept[(where + 1) % len(kept)]
        same = loop.names[before] == loop.names[corner]
        straight = max(abs(loop.bulges[before]), abs(loop.bulges[corner])) <= STRAIGHT
        if same and straight and len(kept) > 3:
            first, last = loop.points[before], loop.points[after]
            along, away = last - first, loop.points[corner] - first
            length = float(np.linalg.norm(along))
            if 0 < along @ away < length**2 and abs(cross(along, away)) <= deviation * length:
                kept.remove(corner)
    return Loop(loop.points[kept], loop.bulges[kept], tuple(loop.names[which] for which in kept))


def _chained(loose: Sequence[Piece], reach: float) -> Closed:
    """Closed curves of pieces that are all part of one."""
    found = joined(loose, reach)
    check_ends(found, reach)
    pieces, nodes, places, gaps = found
    at = (nodes.argsort(axis=None, kind="stable") // 2).reshape(-1, 2).tolist()  # both pieces at each node
    left, loops = set(range(len(pieces))), []
    for first in range(len(pieces)):
        if first not in left:
            continue
        corners, bulges, names, number, node = [], [], [], first, int(nodes[first, 0])
        while number in left:
            left.remove(number)
            forward = nodes[number, 0] == node
            corners.append(places[node])
            bulges.append(pieces[number].bulge if forward else -pieces[number].bulge)
            names.append(pieces[number].label)
            node = int(nodes[number, 1 if forward else 0])
            number = next((each for each in at[node] if each in left), number)
        loops.append(Loop(np.array(corners), np.array(bulges), tuple(names)))
        if np.ptp(loops[-1].points, axis=0).max() <= JOIN and max(map(abs, bulges)) < 1:
            raise UserError(f"what is drawn at {place(corners[0])} is smaller than {JOIN:g} mm; delete it")
    closed = (
        f", {len(gaps)} gap{'s' * (len(gaps) > 1)} of up to {gaps.max():.3g} mm closed" if len(gaps) else ""
    )
    return Closed(tuple(loops), closed)


def _marked(loops: tuple[Loop, ...], mark: Piece) -> tuple[Loop, ...]:
    """The curves with the part under a line or arc named by its label."""
    arc = Loop(np.array([mark.start, mark.end]), np.array([mark.bulge, 0.0]), (mark.label, ""))
    middle = arc.along(0, 0.5)
    number = int(np.argmin([loop.places(middle).distances[0] for loop in loops]))
    ends = np.stack([mark.start, mark.end])
    off = loops[number].places(np.concatenate([middle, ends])).distances.max()
    if off > 0.01:
        raise UserError(
            f"the line {mark.label!r} from {place(mark.start)} to {place(mark.end)} is {off:.3g} mm off "
            "every boundary; draw it on the boundary"
        )
    loop, ways = between(loops[number], ends)
    under = next(way for way in ways if loop.places(middle).pieces[0] in way)
    names = (mark.label if which in under else name for which, name in enumerate(loop.names))
    return (*loops[:number], loop.renamed(names), *loops[number + 1 :])


def between(loop: Loop, ends: FloatArray) -> tuple[Loop, list[list[int]]]:
    """The curve with corners at two points on it, (2, 2), mm, and the pieces of both ways between them."""
    for point in ends:
        (which,), (share,), _ = loop.places(point[None])
        if loop.lengths[which] * min(share, 1 - share) > JOIN:
            loop = loop.split(int(which), [share])
    first, last = np.linalg.norm(loop.points - ends[:, None], axis=2).argmin(axis=1).tolist()
    count = len(loop.points)
    ways = ((first, last), (last, first))
    return loop, [[(start + step) % count for step in range((end - start) % count)] for start, end in ways]

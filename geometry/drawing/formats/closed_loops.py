"""Chains loose lines and arcs into closed curves by their ends, and sorts markers and contact from them."""

from collections.abc import Sequence
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
import shapely

from pinnray.geometry.drawing.formats.drawing import LABELS, Drawing, Scale, place
from pinnray.geometry.drawing.formats.ends import JOIN, check_ends, check_extent, check_twice, joined
from pinnray.geometry.drawing.formats.pieces import Piece
from pinnray.geometry.section.loop import STRAIGHT, Loop
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError

ROUND = 0.02
"""Largest relative difference of the radii of a closed curve that is a circle, of arcs or short lines."""


class Closed(NamedTuple):
    """Closed curves, and in words the gaps that a tolerance closed in them."""

    loops: tuple[Loop, ...]
    note: str = ""


class Marks:
    """Markers and contact, as a reader comes across them."""

    def __init__(self) -> None:
        self._centres: list[FloatArray] = []
        self._diameters: list[float] = []
        self._contact: FloatArray | None = None

    def took(self, centre: FloatArray | None, diameter: float, label: str) -> bool:
        """Keep a circle or, with no diameter, a point as a mark; False if it is none."""
        if centre is None:
            return False
        if label == "markers":
            self._centres.append(centre)
            self._diameters.append(diameter)
        elif label == "contact":
            if self._contact is not None:
                raise UserError(f"two points are called contact, {place(self._contact)} and {place(centre)}")
            self._contact = centre
        return label in ("markers", "contact")

    def drawing(
        self, pieces: Sequence[Piece], scale: Scale, tolerance: float | None, note: str, **facts: Any
    ) -> Drawing:
        """The drawing with its curves closed.

        Args:
            pieces: Lines and arcs, mm.
            scale: Unit of the file's coordinates.
            tolerance: Largest gap that is closed, mm; None means `JOIN`.
            note: How the file was read.
            facts: Further attributes of the drawing.

        Raises:
            UserError: If a curve does not close, the markers differ in diameter, or one is no circle.
        """
        self._take_round([piece for piece in pieces if piece.label == "markers"])
        sizes = [diameter for diameter in self._diameters if diameter > 0]
        if sizes and np.ptp(sizes) > 0.01 * max(sizes):
            raise UserError(
                f"the markers have diameters from {min(sizes):.4g} to {max(sizes):.4g} mm; give all the same"
            )
        rest = [piece for piece in pieces if piece.label != "markers"]
        closed = closed_loops(rest, frozenset(LABELS) - {"markers"}, scale, tolerance)  # which may lie on top
        return Drawing(
            loops=closed.loops,
            note=note + closed.note,
            markers=np.array(self._centres).reshape(-1, 2),
            marker_diameter=float(np.mean(sizes)) if sizes else None,
            contact=self._contact,
            **facts,
        )

    def _take_round(self, pieces: Sequence[Piece]) -> None:
        """Keep closed curves of arcs or short lines as markers: circles of their areas."""
        if not pieces:
            return
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
            self.took(centre, 2 * float(np.sqrt(abs(loop.area) / np.pi)), "markers")


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
            if (
                0 < along @ away < length**2
                and abs(along[0] * away[1] - along[1] * away[0]) <= deviation * length
            ):
                kept.remove(corner)
    return Loop(loop.points[kept], loop.bulges[kept], tuple(loop.names[which] for which in kept))


def nearest_piece(loops: Sequence[Loop], point: FloatArray) -> tuple[int, int, float, float]:
    """The nearest place on curves to a point: loop, piece, fraction of its length, and distance, mm."""
    best = (0, 0, 0.0, np.inf)
    for number, loop in enumerate(loops):
        for which in range(len(loop.points)):
            fraction = _nearest_fraction(loop, which, point)
            distance = float(np.linalg.norm(loop.along(which, fraction)[0] - point))
            if distance < best[3] - 1e-12:
                best = (number, which, fraction, distance)
    return best


def _nearest_fraction(loop: Loop, which: int, point: FloatArray) -> float:
    start, end = loop.ends[which]
    if abs(loop.bulges[which]) <= STRAIGHT:
        return float(np.clip((point - start) @ (end - start) / ((end - start) @ (end - start)), 0, 1))
    centre, _ = loop.circle(which)
    sweep = 4 * np.arctan(loop.bulges[which])
    first, there = (np.arctan2(*(each - centre)[::-1]) for each in (start, point))
    share = float(((there - first) * np.sign(sweep)) % (2 * np.pi) / abs(sweep))
    if share <= 1:
        return share
    return 0.0 if np.linalg.norm(point - start) <= np.linalg.norm(point - end) else 1.0


def _chained(loose: Sequence[Piece], reach: float) -> Closed:
    """Closed curves of pieces that are all part of one."""
    found = joined(loose, reach)
    check_twice(found)
    check_ends(found, reach)
    pieces, nodes, places, gaps = found
    at: dict[int, list[int]] = {}
    for number, pair in enumerate(nodes):
        for node in pair:
            at.setdefault(int(node), []).append(number)
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
    middle = Loop(
        np.array([mark.start, mark.end]), np.array([mark.bulge, 0.0]), (mark.label, "")
    ).along(0, 0.5)[0]  # fmt: skip
    number, _, _, distance = nearest_piece(loops, middle)
    off = [distance]
    loop = loops[number]
    for point in (mark.start, mark.end):
        _, which, fraction, distance = nearest_piece([loop], point)
        off.append(distance)
        loop = cut_at(loop, which, fraction)
    if max(off) > 0.01:
        raise UserError(
            f"the line {mark.label!r} from {place(mark.start)} to {place(mark.end)} is {max(off):.3g} mm off "
            "every boundary; draw it on the boundary"
        )
    first, last = (corner_at(loop, point) for point in (mark.start, mark.end))
    _, under, _, _ = nearest_piece([loop], middle)
    names = list(loop.names)
    way = run_between(first, last, len(names))
    for which in way if under in way else run_between(last, first, len(names)):
        names[which] = mark.label
    return (*loops[:number], loop.renamed(names), *loops[number + 1 :])


def cut_at(loop: Loop, which: int, fraction: float) -> Loop:
    """The curve with a corner at a place, unless there is one within `JOIN`."""
    along = loop.lengths[which] * np.array([fraction, 1 - fraction])
    return loop if along.min() <= JOIN else loop.split(which, [fraction])


def corner_at(loop: Loop, point: FloatArray) -> int:
    """Number of the corner nearest to a point."""
    return int(np.linalg.norm(loop.points - point, axis=1).argmin())


def run_between(first: int, last: int, count: int) -> list[int]:
    """Numbers of the pieces from corner `first` to corner `last`, along the curve."""
    return [(first + step) % count for step in range((last - first) % count)]

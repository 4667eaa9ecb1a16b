"""Chains loose lines and arcs into closed curves by their ends, and sorts markers and contact from them."""

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from geometry.arrays import FloatArray, IntArray
from geometry.drawing.formats.drawing import LABELS, Drawing, place
from geometry.drawing.formats.pieces import FARTHEST, Piece, is_near
from geometry.errors import UserError
from geometry.section.loop import STRAIGHT, Loop

JOIN = 1e-3
"""Largest distance of two ends that count as one, mm."""


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

    def drawing(self, pieces: Sequence[Piece], **facts: Any) -> Drawing:
        """The drawing with its curves closed.

        Raises:
            UserError: If a curve does not close, the markers differ in diameter, or one is no circle.
        """
        if strange := next((piece for piece in pieces if piece.label == "markers"), None):
            raise UserError(f"the marker at {place(strange.start)} is no circle; draw circles or points")
        sizes = [diameter for diameter in self._diameters if diameter > 0]
        if sizes and np.ptp(sizes) > 1e-3:
            raise UserError(
                f"the markers have diameters from {min(sizes):.4g} to {max(sizes):.4g} mm; give all the same"
            )
        return Drawing(
            loops=closed_loops(pieces, frozenset(LABELS) - {"markers"}),  # which may lie on top
            markers=np.array(self._centres).reshape(-1, 2),
            marker_diameter=float(np.mean(sizes)) if sizes else None,
            contact=self._contact,
            **facts,
        )


def closed_loops(pieces: Sequence[Piece], markings: frozenset[str] = frozenset()) -> tuple[Loop, ...]:
    """Closed curves from pieces in any order and direction, mm.

    Pieces labelled as one of `markings` may be part of a curve, or lie on top of it and only name it.
    """
    _check_extent(pieces)
    labels = sorted({piece.label for piece in pieces if piece.label in markings})
    for count in range(len(labels), 0, -1):
        for on_top in combinations(labels, count):
            if not (rest := [piece for piece in pieces if piece.label not in on_top]):
                continue  # they are all there is
            try:
                loops = _chained(rest)
            except UserError:
                continue  # they are part of the boundary
            for mark in (piece for piece in pieces if piece.label in on_top):
                loops = _marked(loops, mark)
            return loops
    return _chained(pieces)


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


def _chained(loose: Sequence[Piece]) -> tuple[Loop, ...]:
    """Closed curves of pieces that are all part of one."""
    pieces, nodes, places = _joined(loose)
    _check_twice(pieces, nodes, places)
    _check_ends(nodes, places)
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
    return tuple(loops)


def _joined(pieces: Sequence[Piece]) -> tuple[list[Piece], IntArray, FloatArray]:
    """Pieces with length, the nodes at their ends (p, 2), and the nodes' places (n, 2)."""
    ends = np.array([[piece.start, piece.end] for piece in pieces]).reshape(-1, 2)
    pairs = cKDTree(ends).query_pairs(JOIN, output_type="ndarray")
    links = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(ends), len(ends)))
    _, node = connected_components(links, directed=False)
    _, first = np.unique(node, return_index=True)
    nodes = node.reshape(-1, 2).astype(np.int64)
    long = nodes[:, 0] != nodes[:, 1]
    lost = np.setdiff1d(nodes[~long], nodes[long])
    if len(lost):
        raise UserError(
            f"what is drawn at {place(ends[first][lost[0]])} is smaller than {JOIN:g} mm; delete it"
        )
    return [piece for piece, kept in zip(pieces, long, strict=True) if kept], nodes[long], ends[first]


def _check_extent(pieces: Sequence[Piece]) -> None:
    if not pieces:
        raise UserError("there is no line or arc in it; draw the boundary of the section")
    ends = np.array([[piece.start, piece.end] for piece in pieces]).reshape(-1, 2)
    if not is_near(ends):
        raise UserError(
            f"a coordinate is not finite or beyond {FARTHEST:g} mm; draw the section near the origin"
        )
    extent = float(np.ptp(ends, axis=0).max())
    if not 1 <= extent <= 2000:
        other = "metres for millimetres" if extent < 1 else "micrometres for millimetres"
        raise UserError(f"the drawing measures {extent:.4g} mm, not 1 to 2000 mm: {other}? give units")


def _check_twice(pieces: Sequence[Piece], nodes: IntArray, places: FloatArray) -> None:
    seen: dict[tuple[int, int, float], int] = {}
    for number, (piece, (start, end)) in enumerate(zip(pieces, nodes.tolist(), strict=True)):
        forward = start < end
        key = (min(start, end), max(start, end), round(piece.bulge if forward else -piece.bulge, 6) + 0.0)
        if key in seen:
            raise UserError(
                f"the curve from {place(places[start])} to {place(places[end])} is drawn twice; delete one"
            )
        seen[key] = number


def _check_ends(nodes: IntArray, places: FloatArray) -> None:
    numbers, times = np.unique(nodes, return_counts=True)
    if (times > 2).any():
        where = places[numbers[times > 2][0]]
        raise UserError(
            f"{times.max()} curves meet at {place(where)}; a boundary has two at every corner and does not "
            "touch itself"
        )
    loose = places[numbers[times == 1]]
    if not len(loose):
        return
    apart = np.linalg.norm(loose[:, None] - loose, axis=2) + np.diag(np.full(len(loose), np.inf))
    gaps = apart.min(axis=1)
    one = int(gaps.argmin())
    other = int(apart[one].argmin())
    raise UserError(
        f"the boundary is open at {place(loose[one])}: a gap of {gaps[one]:.4g} mm to the next end at "
        f"{place(loose[other])}; ends join within {JOIN:g} mm"
    )


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

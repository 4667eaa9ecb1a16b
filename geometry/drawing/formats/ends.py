"""Finds out which ends of pieces are one, and says where a boundary is open, forks or is drawn twice."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from pinnray.geometry.drawing.formats.drawing import UNITS, Scale, place
from pinnray.geometry.drawing.formats.pieces import FARTHEST, Piece, is_near
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.errors import UserError

JOIN = 1e-3
"""Largest distance of two ends that count as one, mm, where no tolerance is given."""

LARGEST_TOLERANCE = 0.5
"""Largest tolerance that may be given, mm."""

EQUAL = 1e-8
"""Distance of ends that differ by rounding only, mm."""

LARGEST = 2000.0
"""Largest extent of a section, mm."""

USUAL = (10.0, 500.0)
"""Extents of fingers, mm. Where mm give such a one and the header's unit another, the unit must be given."""


class Joined(NamedTuple):
    """Pieces with length, the nodes at their ends, and the gaps that were closed between them."""

    pieces: list[Piece]
    nodes: IntArray  # (p, 2)
    places: FloatArray  # of the nodes, (n, 2), mm
    gaps: FloatArray  # widths of the gaps wider than `JOIN`, mm


def joined(pieces: Sequence[Piece], tolerance: float = JOIN) -> Joined:
    """Pieces whose ends are nodes.

    Equal ends are one node. Two loose ends within the tolerance are joined if each is the nearest to the
    other, so that short lines stay: no end is joined with more than one other.
    """
    ends = np.array([[piece.start, piece.end] for piece in pieces]).reshape(-1, 2)
    node = _clusters(ends, cKDTree(ends).query_pairs(EQUAL, output_type="ndarray"))
    _, first = np.unique(node, return_index=True)
    places = ends[first]
    nodes = node.reshape(-1, 2).astype(np.int64)
    long = nodes[:, 0] != nodes[:, 1]
    lost = np.setdiff1d(nodes[~long], nodes[long])
    if len(lost):
        raise UserError(f"what is drawn at {place(places[lost[0]])} is smaller than {JOIN:g} mm; delete it")
    kept = [piece for piece, is_long in zip(pieces, long, strict=True) if is_long]
    links, gaps = _matches(nodes[long], places, tolerance)
    same = _clusters(places, links)
    _, first = np.unique(same, return_index=True)
    return Joined(kept, same[nodes[long]].astype(np.int64), places[first], gaps[gaps > JOIN])


def _clusters(points: FloatArray, pairs: IntArray) -> IntArray:
    links = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    return np.asarray(connected_components(links, directed=False)[1])


def _matches(nodes: IntArray, places: FloatArray, tolerance: float) -> tuple[IntArray, FloatArray]:
    """Pairs of loose ends (k, 2), each nearest to the other, that are one, with their distances, mm."""
    ends = np.flatnonzero(np.bincount(nodes.ravel(), minlength=len(places)) == 1)
    if len(ends) < 2:
        return np.empty((0, 2), dtype=np.int64), np.empty(0)
    apart, nearest = _nearest(places[ends])
    numbers = np.arange(len(ends))
    one = np.flatnonzero((nearest[nearest] == numbers) & (numbers < nearest) & (apart <= tolerance))
    return np.stack([ends[one], ends[nearest[one]]], axis=1), apart[one]


def _nearest(points: FloatArray) -> tuple[FloatArray, IntArray]:
    """Distance of each point from the nearest other one, mm, and the number of that one."""
    apart, numbers = cKDTree(points).query(points, k=2)
    return apart[:, 1], numbers[:, 1]


def check_extent(pieces: Sequence[Piece], scale: Scale) -> None:
    """Raise a `UserError` if there are no pieces, or they are too small, too large or too far away."""
    if not pieces:
        raise UserError("there is no line or arc in it; draw the boundary of the section")
    ends = np.array([[piece.start, piece.end] for piece in pieces]).reshape(-1, 2)
    if not is_near(ends):
        raise UserError(
            f"a coordinate is not finite or beyond {FARTHEST:g} mm, read in {scale}; draw near the origin"
        )
    extent = float(np.ptp(ends, axis=0).max())
    drawn = extent / scale.length
    usual = USUAL[0] / 2 <= extent <= USUAL[1] or not USUAL[0] <= drawn <= USUAL[1]
    beyond = "" if 1 <= extent <= LARGEST else f", not 1 to {LARGEST:g} mm"
    if beyond or (scale.origin == "of the header" and not usual):
        other = "m" if scale.length == 1 else "mm"
        raise UserError(
            f"read in {scale} the drawing measures {extent:.4g} mm{beyond}; give its units: "
            f'units = "{other}" makes it {drawn * UNITS[other]:.4g} mm'
        )


def check_ends(found: Joined, tolerance: float) -> None:
    """Raise a `UserError` if a boundary forks or is open, with the tolerance that closes small gaps."""
    numbers, times = np.unique(found.nodes, return_counts=True)
    if (times > 2).any():
        where = found.places[numbers[times > 2][0]]
        raise UserError(
            f"{times.max()} curves meet at {place(where)}; a boundary has two at every corner, and none twice"
        )
    loose = found.places[numbers[times == 1]]
    if not len(loose):
        return
    gaps, nearest = _nearest(loose)
    one = int(gaps.argmin())
    remedy = f", or give tolerance = {1.1 * gaps.max():.2g}" if gaps.max() <= LARGEST_TOLERANCE else ""
    raise UserError(
        f"the boundary is open at {place(loose[one])}: a gap of {gaps[one]:.4g} mm to the next end at "
        f"{place(loose[nearest[one]])}; ends join within {tolerance:.4g} mm; close it{remedy}"
    )

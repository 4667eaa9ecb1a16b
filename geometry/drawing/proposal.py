"""Proposes a clamp, a contact and markers where a drawing has none; one drawing gets one proposal.

Clamp: the flat end. Straight pieces on the convex hull that face along the outline's principal axis, within
45 degrees, are ends; of those that are at least 0.8 as wide as the widest the one in most pieces (two feet
beside a slot), then the widest, then the one at smaller x.
Contact: on the longest straight piece of the hull that looks sideways from the clamp, where those within 1 %
count as equal and the upper one is taken; halfway between its end at the clamp and the last cavity beneath
it, or its own end.
A body without such a piece has to be given its clamp or contact.
Markers: evenly along the longest unclamped runs of the outline, front, tip and back, each as deep in as
leaves most material around it, at most 2 mm and in a solid part a quarter of the way through. Where that
would put one into a sharp tip, with less than a quarter of the others' room, they are spread over the rest.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely

from pinnray.geometry.section.loop import Loop
from pinnray.geometry.section.section import Section
from pinnray.geometry.section.thickness import inner_normals, through
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError

MARKERS = 9
SIDEWAYS = np.cos(np.radians(45))
ON_HULL = 1e-3
"""Largest distance of a piece from the hull on which it lies, mm."""


class FlatSide(NamedTuple):
    """A straight side of a body's convex hull."""

    pieces: tuple[int, ...]  # of the outline
    normal: FloatArray  # outer unit normal (2,)
    width: float  # distance of its outermost corners, mm
    x: float  # of its middle, mm


def with_clamp(outline: Loop) -> Loop:
    """The outline with a proposed clamp as its pieces `base`."""
    axis = _principal_axis(outline)
    ends = [end for end in _flat_sides(outline) if abs(end.normal @ axis) >= SIDEWAYS]
    extent = float(np.ptp(outline.points @ np.array([-axis[1], axis[0]])))
    ends = [end for end in ends if end.width >= 0.2 * extent]
    if not ends:
        raise UserError(
            "it has no flat end to be clamped; give clamp = [[x, y], [x, y]], two points of the outline"
        )
    widest = max(end.width for end in ends)
    best = max(
        (end for end in ends if end.width >= 0.8 * widest),
        key=lambda end: (len(end.pieces), round(end.width * abs(float(end.normal @ axis)), 6), -end.x),
    )
    names = ("base" if number in best.pieces else name for number, name in enumerate(outline.names))
    return outline.renamed(names)


def contact_point(section: Section) -> FloatArray:
    """A proposed middle of the contact, shape (2,), mm, on a section with a clamp."""
    outline = section.outline
    middle, normal = _clamp_frame(outline)
    flat = [side for side in _flat_sides(outline) if abs(side.normal @ normal) <= SIDEWAYS]
    sides = [side.pieces[0] for side in flat if len(side.pieces) == 1]
    least = 0.3 * float(np.ptp(section.bounds, axis=0).max())
    free = [which for which in sides if outline.names[which] != "base" and outline.lengths[which] >= least]
    if not free:
        raise UserError(
            "it has no straight side to be touched; give contact = [x, y], a point of the outline"
        )
    scores = {
        which: outline.lengths[which] * (1 - (inner_normals(outline, which, 0.5)[0] @ normal) ** 2)
        for which in free
    }
    best = [which for which in free if scores[which] >= 0.99 * max(scores.values())]
    chosen = max(best, key=lambda which: round(float(-inner_normals(outline, which, 0.5)[0, 1]), 6))
    return _mid_span(section, chosen, middle)


def marker_places(section: Section, count: int) -> FloatArray:
    """Proposed centres of markers, shape (count, 2), mm, in a section with a clamp."""
    runs = section.outline.runs(which for which, name in enumerate(section.outline.names) if name != "base")
    lengths = np.array([float(section.outline.lengths[run].sum()) for run in runs])
    long = np.flatnonzero(lengths >= lengths.max() / 2)
    shares = np.round(count * np.cumsum(lengths[long]) / lengths[long].sum())
    counts = np.diff(shares, prepend=0).astype(int)
    return np.concatenate(
        [_along(section, runs[which], own) for which, own in zip(long, counts, strict=True)]
    )


def _along(section: Section, run: list[int], count: int) -> FloatArray:
    """Centres of markers along a run of pieces, shape (count, 2), mm."""
    total = float(section.outline.lengths[run].sum())
    places = _below(section, run, total * np.arange(1, count + 1) / (count + 1))
    room = section.clearance(places)
    if (room >= 0.25 * np.median(room)).all():
        return places
    steps = total * (np.arange(400) + 0.5) / 400  # a sharp tip has no room: leave such stretches out
    room = section.clearance(_below(section, run, steps))
    wide = steps[room >= 0.25 * np.median(room)]
    return _below(section, run, wide[len(wide) * np.arange(1, count + 1) // (count + 1)])


def _below(section: Section, run: list[int], along: FloatArray) -> FloatArray:
    """Places with most material around them below points of a run, given by arc length (n,), mm: (n, 2)."""
    outline, places = section.outline, []
    for each in along:
        which, fraction = outline.place_in(run, each)
        point, normal = outline.along(which, fraction)[0], inner_normals(outline, which, fraction)[0]
        inward = point + np.linspace(0, _deepest(section, point, normal), 81)[1:, None] * normal
        places.append(inward[int(np.round(section.clearance(inward), 6).argmax())])
    return np.array(places).reshape(-1, 2)


def _deepest(section: Section, point: FloatArray, normal: FloatArray) -> float:
    """Largest depth of a marker below a point of the outline, mm; in a solid part not halfway through."""
    crossing = through(section, point, normal)
    solid = crossing.pieces[0] < len(section.outline.points)
    return min(2.0, float(crossing.lengths[0]) / 4) if solid else 2.0


def marker_diameter(section: Section, places: FloatArray) -> float:
    """A proposed diameter of markers with centres (m, 2) in the body, mm; in steps of 0.01 mm above that."""
    largest = min(1.6, 0.8 * 2 * float(section.clearance(places).min()))
    return float(np.floor(100 * largest + 1e-6) / 100 or largest)


def contact_width(outline: Loop, middle: float) -> float:
    """A proposed extent of the contact around an abscissa, mm, on an outline with a front."""
    front = np.concatenate([outline.ends[which][:, 0] for which in outline.pieces("front")])
    beside = min(middle - front.min(), front.max() - middle)
    widest = min(2.0, float(np.ptp(front)) / 5)
    return min(widest, 2 * float(beside)) if beside > 1e-3 else widest  # at the very end the check refuses it


def _principal_axis(outline: Loop) -> FloatArray:
    ring = shapely.LinearRing(outline.flattened())
    points = shapely.get_coordinates(shapely.segmentize(ring, ring.length / 1000))
    values, vectors = np.linalg.eigh(np.cov(points.T))
    return np.array([1.0, 0.0]) if values[0] > 0.9 * values[1] else np.asarray(vectors[:, 1])


def _flat_sides(outline: Loop) -> Iterator[FlatSide]:
    """Sides of the convex hull on which straight pieces lie."""
    corners = outline.flattened(1e-4)
    normals = {which: -inner_normals(outline, which, 0.5)[0] for which in outline.straight.tolist()}
    left = {
        which: normal
        for which, normal in normals.items()
        if (corners @ normal).max() <= (outline.ends[which] @ normal).min() + ON_HULL
    }
    while left:
        first, normal = next(iter(left.items()))
        offset = outline.points[first] @ normal
        group = [
            which
            for which in left
            if left[which] @ normal > 1 - 1e-6 and abs(outline.points[which] @ normal - offset) < 10 * ON_HULL
        ]
        ends = outline.ends[group].reshape(-1, 2)
        along = ends @ np.array([-normal[1], normal[0]])
        yield FlatSide(tuple(group), normal, float(np.ptp(along)), float(ends[:, 0].mean()))
        left = {which: other for which, other in left.items() if which not in group}


def _clamp_frame(outline: Loop) -> tuple[FloatArray, FloatArray]:
    """Middle of the clamp and its mean outer normal."""
    base = list(outline.pieces("base"))
    weights = outline.lengths[base]
    middles = np.concatenate([outline.along(which, 0.5) for which in base])
    normals = np.concatenate([-inner_normals(outline, which, 0.5) for which in base])
    normal = weights @ normals
    return weights @ middles / weights.sum(), normal / max(float(np.linalg.norm(normal)), 1e-12)


def _mid_span(section: Section, which: int, clamp: FloatArray) -> FloatArray:
    """Halfway from a piece's end at the clamp to the last cavity beneath it, or to its other end."""
    near, far = sorted(section.outline.ends[which], key=lambda end: float(np.linalg.norm(end - clamp)))
    length = float(np.linalg.norm(far - near))
    along = (far - near) / length
    reach = [float(((cavity.flattened() - near) @ along).max()) for cavity in section.cavities]
    reach = [min(each, length) for each in reach if each > 0]
    return np.asarray(near + along * 0.5 * max(reach, default=length))

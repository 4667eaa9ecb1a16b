"""Checks of a drawn section: one line each, with the place and the remedy."""

import re
from collections.abc import Sequence

import numpy as np
import shapely
from scipy.spatial import cKDTree

from pinnray.geometry.drawing.formats.closed_loops import straightened
from pinnray.geometry.drawing.formats.drawing import place
from pinnray.geometry.drawing.placement import on_curve
from pinnray.geometry.section.loop import Loop
from pinnray.geometry.section.section import DEVIATION, Section
from pinnray.geometry.section.thickness import inner_normals, wall_thickness
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError

APART = 1e-3
"""Smallest distance of two curves, mm."""


def body(loops: Sequence[Loop]) -> Section:
    """The section between closed curves, mm: the largest is the outline, the others are cavities."""
    for loop in loops:
        _check_simple(loop)
    ordered = sorted(loops, key=lambda loop: -abs(loop.area))
    outline, *cavities = [
        loop if (loop.area > 0) == (number == 0) else loop.reversed()
        for number, loop in enumerate(map(straightened, ordered))
    ]
    _check_apart(outline, cavities)
    section = Section(outline, tuple(cavities))
    thickness, where = least_thickness(section)
    if thickness < 0.05:
        raise UserError(
            f"the wall at {place(where)} is {thickness:.3g} mm thin; make every wall at least 0.05 mm"
        )
    return section


def least_thickness(section: Section) -> tuple[float, FloatArray]:
    """Thickness of the thinnest wall, mm, and a point on it, shape (2,); infinite without a wall."""
    extent = float(np.ptp(section.bounds, axis=0).max())
    points, thickness = wall_thickness(section, extent / 400)
    if not len(points):
        return float("inf"), section.outline.points[0]
    which = int(thickness.argmin())
    return float(thickness[which]), points[which]


def check_contact(outline: Loop, contact: FloatArray) -> tuple[int, float]:
    """The piece of the outline, and the fraction of its length, that the contact's middle is on."""
    which, fraction = on_curve(outline, contact, "contact")
    if outline.names[which] == "base":
        raise UserError(
            f"the contact at {place(contact)} is on the clamp; move it to a free part of the outline"
        )
    beside = which if fraction == 0 else which + 1 if fraction == 1 else None
    if beside is not None and abs(_bend(outline, beside % len(outline.points))) > np.radians(30):
        raise UserError(f"the contact at {place(contact)} is on a corner, which has no normal; move it along")
    return which, fraction


def check_markers(section: Section, markers: FloatArray, diameter: float) -> None:
    """Raise a `UserError` if a marker (m, 2), mm, is not wholly in the body, or two are at one place."""
    clearance = section.clearance(markers)
    worst = int(clearance.argmin())
    if clearance[worst] <= 0:
        raise UserError(
            f"marker {worst + 1} at {place(markers[worst])} is outside the body; move it into a wall"
        )
    if clearance[worst] < diameter / 2 - 1e-6:
        raise UserError(
            f"marker {worst + 1} at {place(markers[worst])} has {clearance[worst]:.3g} mm of material around "
            f"it, less than its radius of {diameter / 2:.3g} mm; move it, or make marker_diameter at most "
            f"{2 * clearance[worst]:.3g} mm"
        )
    near = cKDTree(markers).query_pairs(1e-6)
    if near:
        first, second = sorted(near)[0]
        raise UserError(
            f"markers {first + 1} and {second + 1} are both at {place(markers[first])}; delete one"
        )


def _bend(outline: Loop, corner: int) -> float:
    """Turn of the outline at a corner, radians."""
    into, out = inner_normals(outline, corner - 1, 1.0)[0], inner_normals(outline, corner, 0.0)[0]
    return float(np.arctan2(into[0] * out[1] - into[1] * out[0], into @ out))


def _check_simple(loop: Loop) -> None:
    if abs(loop.area) < 1e-4 and float(np.ptp(loop.bounds, axis=0).min()) < APART:
        raise UserError(f"the closed curve at {place(loop.points[0])} encloses no area; delete it")
    ring = shapely.Polygon(loop.flattened(DEVIATION)[0])
    if not ring.is_valid:
        reason = shapely.is_valid_reason(ring)
        numbers = [float(number) for number in re.findall(r"-?[0-9.]+(?:e[-+]?[0-9]+)?", reason)[-2:]]
        raise UserError(
            f"the curve crosses or touches itself at {place(np.array(numbers))}; draw it as one simple curve"
        )


def _check_apart(outline: Loop, cavities: Sequence[Loop]) -> None:
    outer = shapely.Polygon(outline.flattened(DEVIATION)[0])
    rings = [shapely.Polygon(cavity.flattened(DEVIATION)[0]) for cavity in cavities]
    for cavity, ring in zip(cavities, rings, strict=True):
        at = place(cavity.points[0])
        if outer.equals_exact(ring, APART) or (
            abs(outer.area - ring.area) < 1e-6 * outer.area and outer.symmetric_difference(ring).area < 1e-6
        ):
            raise UserError(f"the outline is drawn twice, at {at}; delete one")
        if not outer.intersects(ring):
            raise UserError(f"the curve at {at} is a body of its own outside the outline; keep one body")
        _check_contact(outer.exterior, ring, f"the cavity at {at}", "the outline")
    if not rings:
        return
    tree = shapely.STRtree(rings)
    for first, second in np.stack(
        tree.query(np.array(rings), predicate="dwithin", distance=APART), axis=1
    ).tolist():
        if first >= second:
            continue
        one, other = (f"the cavity at {place(cavities[which].points[0])}" for which in (first, second))
        if rings[first].contains_properly(rings[second]) or rings[second].contains_properly(rings[first]):
            raise UserError(f"{other} is inside {one}; a body in a cavity is not connected: delete one")
        if rings[first].symmetric_difference(rings[second]).area < 1e-9 + 1e-6 * rings[first].area:
            raise UserError(f"{one} is drawn twice; delete one")
        _check_contact(rings[first].exterior, rings[second], other, one)


def _check_contact(line: shapely.LinearRing, ring: shapely.Polygon, name: str, other: str) -> None:
    if line.distance(ring.exterior) >= APART:
        return
    point = shapely.shortest_line(line, ring.exterior)
    where = place(np.array(point.coords[0]))
    touches = "crosses" if line.crosses(ring) else "touches"
    raise UserError(f"{name} {touches} {other} at {where}; leave a wall between them")

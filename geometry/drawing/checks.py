"""Checks of a drawn section: one line each, with the place and the remedy."""

from collections.abc import Sequence

import numpy as np
import shapely
from scipy.spatial import cKDTree

from pinnray.geometry.drawing.formats.closed_loops import straightened
from pinnray.geometry.drawing.formats.drawing import place
from pinnray.geometry.drawing.placement import on_curve
from pinnray.geometry.section.loop import Loop
from pinnray.geometry.section.section import DEVIATION, Section
from pinnray.geometry.section.thickness import corner_turns, wall_thickness
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError

APART = 1e-3
"""Smallest distance of two curves, mm."""

LEAST_AREA = 1e-4
"""Smallest area within a curve, mm^2."""


def body(loops: Sequence[Loop]) -> Section:
    """The section between closed curves, mm: the largest is the outline, the others are cavities."""
    ordered = sorted(loops, key=lambda loop: -abs(loop.area))
    _check_sound([shapely.LinearRing(loop.flattened(DEVIATION)) for loop in ordered])
    if abs(ordered[-1].area) < LEAST_AREA:
        raise UserError(f"the closed curve at {place(ordered[-1].points[0])} encloses no area; delete it")
    outline, *cavities = [
        loop if (loop.area > 0) == (number == 0) else loop.reversed()
        for number, loop in enumerate(map(straightened, ordered))
    ]
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
    if beside is not None and abs(corner_turns(outline)[beside % len(outline.points)]) > np.radians(30):
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


def _check_sound(rings: Sequence[shapely.LinearRing]) -> None:
    """Raise a `UserError` if the curves are not one outline with cavities apart from it and each other."""
    reason = shapely.is_valid_reason(shapely.Polygon(rings[0], rings[1:]))  # as in Self-intersection[50 -5]
    fault, _, point = reason.partition("[")
    lines = np.array(rings)
    near = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=APART).T
    if fault != "Valid Geometry":
        where = np.array(point.rstrip("]").split()[:2], dtype=np.float64)
    elif len(touching := near[near[:, 0] < near[:, 1]]):
        fault, where = "two curves touch", np.array(shapely.shortest_line(*lines[touching[0]]).coords[0])
    else:
        return
    fault = fault.lower().replace("hole lies outside shell", "a closed curve lies outside the outline")
    raise UserError(
        f"{fault} at {place(where)}; draw one outline, and inside it cavities that neither cross nor "
        "touch it or each other"
    )

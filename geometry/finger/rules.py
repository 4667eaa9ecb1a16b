"""Rules that a finger has to obey: each gives a margin and the fault in words."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import shapely
from scipy.spatial.distance import pdist

from pinnray.geometry.finger import section
from pinnray.geometry.finger.markers import marker_positions
from pinnray.geometry.finger.parameters import MARKER, Parameters, parameter_info

# Least lengths, mm.
MIN_CAVITY = 0.5  # clear width of a cavity, for printing and meshing
MIN_CONTACT_MARGIN = 0.5  # from the contact to the clamped base and to the apex
MIN_MARKER_WALL = 0.1  # material around a marker
MIN_DEPTH_LEFT = 0.2  # material below a marker's pocket
MIN_STRAIGHT = 1e-3  # between two roundings
MIN_WALL = 0.2  # of the base and around a slot

ROUNDING = -1e-9
"""Tolerance of the margins, mm."""


class RuleResult(NamedTuple):
    """Outcome of a rule."""

    margin: float  # zero or more if the rule is obeyed, mm
    sentence: str  # the fault if it is not, with the numbers


def broken_rule(p: Parameters) -> str | None:
    """The fault of a finger that breaks a rule, with the numbers; else None."""
    results = (rule(p) for rule in RULES)
    return next((result.sentence for result in results if result.margin < ROUNDING), None)


def cavities_open(p: Parameters) -> RuleResult:
    """Walls, ribs and tip leave every cavity open."""
    first, last = section.cells(p)[0], section.cells(p)[-1]
    near, far = ("first rib", "last rib") if p.rib_count else ("tip block", "base wall")
    gaps = {
        "front and back wall at the tip block": last[3, 1] - last[2, 1],
        f"base wall and {near}": (first[[3, 2]] - first[[0, 1]])[:, 0].min(),
        f"{far} and tip block": (last[[3, 2]] - last[[0, 1]])[:, 0].min(),
    }
    if p.rib_count > 1:
        slope = np.radians(section.rib_slope(p))
        gaps["neighbouring ribs"] = section.rib_pitch(p) * np.cos(slope) - p.rib_thickness
    where = min(gaps, key=gaps.__getitem__)
    return RuleResult(
        float(gaps[where]) - MIN_CAVITY,
        f"no room for the cavities: {p.rib_count} ribs of {p.rib_thickness:g} mm at {p.rib_angle:g} deg, "
        f"base_thickness {p.base_thickness:g} mm, tip_length {p.tip_length:g} mm, front_thickness "
        f"{p.front_thickness:g} mm and back_thickness {p.back_thickness:g} mm leave {gaps[where]:.3g} mm "
        f"between {where}, at least {MIN_CAVITY} mm is needed",
    )


def base_wall(p: Parameters) -> RuleResult:
    """A wall closes the cavity at the base: inside the base line or, with a foot, above its slot."""
    slot = p.lip_thickness + p.slot_height if p.slot_width > 0 else 0.0
    wall = p.base_thickness + p.foot_height - slot
    return RuleResult(
        wall - MIN_WALL,
        f"the base is open: base_thickness {p.base_thickness:g} mm and foot_height {p.foot_height:g} mm "
        f"leave a wall of {wall:.3g} mm, at least {MIN_WALL} mm is needed",
    )


def slot_fits(p: Parameters) -> RuleResult:
    """A slot lies in the foot, between lips, and is open."""
    if p.slot_width == 0:
        return RuleResult(np.inf, "")
    beside, above = (p.base_width - p.slot_width) / 2, p.foot_height - p.lip_thickness - p.slot_height
    margins = {
        "slot_opening must be above 0 mm": p.slot_opening - MIN_STRAIGHT,
        "slot_height must be above 0 mm": p.slot_height - MIN_STRAIGHT,
        f"lip_thickness must be at least {MIN_WALL} mm": p.lip_thickness - MIN_WALL,
        "slot_opening must be at most slot_width": p.slot_width - p.slot_opening,
        f"slot_width must leave walls of {MIN_WALL} mm in base_width": beside - MIN_WALL,
        "lip_thickness and slot_height must be less than foot_height": above,
    }
    worst = min(margins, key=margins.__getitem__)
    return RuleResult(float(margins[worst]), f"the slot does not fit into the foot: {worst}")


def tip_rounded(p: Parameters) -> RuleResult:
    """The tip's rounding stays within the solid tip."""
    apex = np.array([p.height, 0.0])
    behind = float(np.linalg.norm(apex - section.back_line(p, 0.0).meets(section.tip_line(p))))
    tangent = section.tip_tangent(p)
    return RuleResult(
        min(p.tip_length, behind) - tangent - MIN_STRAIGHT,
        f"tip_radius too large: {p.tip_radius:g} mm rounds {tangent:.4g} mm of front and back face, "
        f"the solid tip has {min(p.tip_length, behind):.4g} mm",
    )


def contact_on_front(p: Parameters) -> RuleResult:
    """The contact lies on the front face, clear of base and apex."""
    low, high = p.contact_ends
    end = p.height - section.tip_tangent(p) - MIN_CONTACT_MARGIN
    return RuleResult(
        min(low - MIN_CONTACT_MARGIN, end - high),
        f"contact outside the front face: at contact_position {p.contact_abscissa:.6g} mm it reaches from "
        f"x = {low:.6g} to {high:.6g} mm, the face allows {MIN_CONTACT_MARGIN:g} to {end:.6g} mm",
    )


def fillets_fit(p: Parameters) -> RuleResult:
    """Two fillets fit on every side of every cell."""
    room = np.inf
    for cell in section.cells(p) if p.fillet_radius > 0 else ():
        tangents = p.fillet_radius / np.tan(section.corner_angles(cell) / 2)
        sides = np.linalg.norm(np.roll(cell, -1, axis=0) - cell, axis=1)
        room = min(room, float((sides - tangents - np.roll(tangents, -1)).min()))
    return RuleResult(
        room - MIN_STRAIGHT,
        f"fillets too large: two of fillet_radius {p.fillet_radius:g} mm need {-room:.3g} mm more than the "
        "shortest side of a cavity has",
    )


def markers_fit(p: Parameters) -> RuleResult:
    """Every marker lies in the material; the cavities' roundings are left out."""
    worst, room = _marker_room(p)
    x, y = marker_positions(p)[worst]
    return RuleResult(
        (room - _smallest_marker(p)) / 2,
        f"marker {worst + 1} of layout {p.marker_layout!r} at ({x:.4g}, {y:.4g}) mm does not fit into the "
        f"material: {_marker_words(p)}, there is room for {max(room, 0):.3g} mm",
    )


def markers_apart(p: Parameters) -> RuleResult:
    """Neighbouring markers leave material between them."""
    count, nearest, least = len(marker_positions(p)), _nearest_markers(p), _smallest_marker(p)
    return RuleResult(
        nearest - least - MIN_MARKER_WALL,
        f"markers overlap: {count} markers of layout {p.marker_layout!r} are {nearest:.3g} mm apart, at "
        f"least {least + MIN_MARKER_WALL:g} mm is needed: {_marker_words(p)}",
    )


def fitting_marker(p: Parameters) -> float:
    """Diameter of the markers, mm: as asked for, but markers of the default diameter shrink where they must.

    Args:
        p: A finger that obeys every rule.
    """
    if p.marker_diameter != MARKER:
        return p.marker_diameter
    room = min(_marker_room(p)[1], _nearest_markers(p) - MIN_MARKER_WALL)
    hundredths = np.floor(100 * room + 1e-6)  # so that a wall of 1 mm has markers of 0.8, not 0.79 mm
    return float(np.clip(hundredths / 100, _smallest_marker(p), MARKER))


def _smallest_marker(p: Parameters) -> float:
    """Diameter that has to fit, mm: any will do where no other than the default is asked for."""
    return (
        float(parameter_info("marker_diameter", "low")) if p.marker_diameter == MARKER else p.marker_diameter
    )


def _marker_words(p: Parameters) -> str:
    shrinks = ", which shrinks," if p.marker_diameter == MARKER else ""
    return f"marker_diameter{shrinks} is {'at least ' if shrinks else ''}{_smallest_marker(p):g} mm"


def _marker_room(p: Parameters) -> tuple[int, float]:
    """The marker that has the least room around it, and the largest diameter that fits there, mm."""
    centres = marker_positions(p)
    body = shapely.Polygon(section.finger_outline(p).flattened(), list(section.cells(p)))
    away = shapely.distance(body.boundary, shapely.points(centres))
    margins = np.where(shapely.contains_xy(body, *centres.T), away, -away)
    worst = int(margins.argmin())
    return worst, 2 * float(margins[worst] - MIN_MARKER_WALL)


def _nearest_markers(p: Parameters) -> float:
    """Smallest distance of two markers, mm."""
    centres = marker_positions(p)
    return float(pdist(centres).min()) if len(centres) > 1 else np.inf


def markers_not_through(p: Parameters) -> RuleResult:
    """The markers' pockets leave material below them."""
    return RuleResult(
        p.depth - p.marker_height - MIN_DEPTH_LEFT,
        f"marker_height {p.marker_height:g} mm goes through the finger: depth {p.depth:g} mm less "
        f"{MIN_DEPTH_LEFT} mm is the most",
    )


RULES: tuple[Callable[[Parameters], RuleResult], ...] = (
    *(cavities_open, base_wall, slot_fits, tip_rounded, contact_on_front, fillets_fit),
    *(markers_fit, markers_apart, markers_not_through),
)
"""In the order of checking: the later ones presuppose the earlier ones."""

"""Rules that a finger has to obey: each gives a margin, a message, and the parameters that can remedy it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import pdist

from geometry.finger.parameters import Parameters
from geometry.finger.section import (
    back_offset_line,
    corner_angles,
    finger_section,
    inside_distance,
    marker_positions,
    polygon_sides,
    rib_pitch,
)

MIN_CAVITY = 0.5
"""Minimum clear width of a cavity, mm, for printing and meshing."""

MIN_CONTACT_MARGIN = 0.5
"""Minimum distance of the contact from the clamped base and from the apex, mm."""

MIN_MARKER_WALL = 0.1
"""Minimum material around a marker, mm."""

MIN_DEPTH_LEFT = 0.2
"""Minimum material below a marker's pocket, mm."""

MIN_STRAIGHT = 1e-3
"""Minimum straight length between two fillets, mm."""


@dataclass(frozen=True)
class RuleResult:
    """Outcome of a rule.

    Attributes:
        margin: Zero or more if the rule is obeyed, mm.
        sentence: The fault if it is not, with the numbers.
    """

    margin: float
    sentence: str


@dataclass(frozen=True)
class Rule:
    """One condition on a finger.

    Attributes:
        check: Evaluates the rule.
        remedies: Parameters whose change can satisfy it, the likeliest first.
    """

    check: Callable[[Parameters], RuleResult]
    remedies: tuple[str, ...]


def cavity_length(p: Parameters) -> RuleResult:
    """Base wall and tip leave room for a cavity."""
    length = p.height - p.tip_length - p.base_thickness
    return RuleResult(
        length - MIN_CAVITY,
        f"no room for a cavity: height {p.height:g} mm less tip_length {p.tip_length:g} mm and "
        f"base_thickness {p.base_thickness:g} mm leaves {length:.3g} mm, at least {MIN_CAVITY} mm is needed",
    )


def cavity_open(p: Parameters) -> RuleResult:
    """Front and back wall stay apart up to the tip block."""
    slope, intercept = back_offset_line(p, p.back_thickness)
    opening = -p.front_thickness - slope * (p.height - p.tip_length) - intercept
    return RuleResult(
        opening - MIN_CAVITY,
        f"walls close the cavity: front_thickness {p.front_thickness:g} mm and back_thickness "
        f"{p.back_thickness:g} mm leave {opening:.3g} mm between them at the tip block, at least "
        f"{MIN_CAVITY} mm is needed",
    )


def ribs_apart(p: Parameters) -> RuleResult:
    """Neighbouring ribs leave a gap."""
    gap = rib_pitch(p) * np.cos(np.radians(p.rib_angle)) - p.rib_thickness
    return RuleResult(
        float(gap) - MIN_CAVITY if p.rib_count > 1 else np.inf,
        f"ribs {'overlap' if gap < 0 else 'are too close'}: {p.rib_count} ribs of {p.rib_thickness:g} mm at "
        f"{p.rib_angle:g} deg leave gaps of {gap:.3g} mm, at least {MIN_CAVITY} mm is needed",
    )


def ribs_clear_of_base(p: Parameters) -> RuleResult:
    """The first rib stays clear of the base wall at both its ends."""
    return _cavity_width(p, 0, "first rib runs into the base wall")


def ribs_clear_of_tip(p: Parameters) -> RuleResult:
    """The last rib stays clear of the tip block at both its ends."""
    return _cavity_width(p, -1, "last rib runs into the tip block")


def contact_on_front(p: Parameters) -> RuleResult:
    """The contact lies on the front face, clear of base and apex."""
    low, high = p.contact_ends
    return RuleResult(
        min(low, p.height - high) - MIN_CONTACT_MARGIN,
        f"contact outside the front face: it reaches from x = {low:.6g} to {high:.6g} mm, the face allows "
        f"{MIN_CONTACT_MARGIN:g} to {p.height - MIN_CONTACT_MARGIN:g} mm",
    )


def fillets_fit(p: Parameters) -> RuleResult:
    """Two fillets fit on every side of every cell."""
    room = np.inf
    for cavity in finger_section(p).cavities if p.fillet_radius > 0 else ():
        tangents = p.fillet_radius / np.tan(corner_angles(cavity) / 2)
        room = min(room, float((polygon_sides(cavity) - tangents - np.roll(tangents, -1)).min()))
    return RuleResult(
        room - MIN_STRAIGHT,
        f"fillets too large: two of fillet_radius {p.fillet_radius:g} mm need {-room:.3g} mm more than the "
        "shortest side of a cavity has",
    )


def markers_fit(p: Parameters) -> RuleResult:
    """Every marker lies in the material.

    Markers sit in the middle of a wall or on the tip's bisector, so no cavity is nearer than the outline.
    """
    centres = marker_positions(p)
    margins = inside_distance(finger_section(p).outer, centres)
    worst = int(margins.argmin())
    x, y = centres[worst]
    room = 2 * (margins[worst] - MIN_MARKER_WALL)
    return RuleResult(
        float(margins[worst] - MIN_MARKER_WALL - p.marker_radius),
        f"marker {worst + 1} of layout {p.marker_layout!r} at ({x:.4g}, {y:.4g}) mm does not fit into the "
        f"material: marker_diameter is {p.marker_diameter:g} mm, there is room for {max(room, 0):.3g} mm",
    )


def markers_apart(p: Parameters) -> RuleResult:
    """Neighbouring markers leave material between them."""
    centres = marker_positions(p)
    nearest = float(pdist(centres).min()) if len(centres) > 1 else np.inf
    return RuleResult(
        nearest - p.marker_diameter - MIN_MARKER_WALL,
        f"markers overlap: {len(centres)} markers of layout {p.marker_layout!r} with marker_diameter "
        f"{p.marker_diameter:g} mm are {nearest:.3g} mm apart, at least "
        f"{p.marker_diameter + MIN_MARKER_WALL:g} mm is needed",
    )


def markers_not_through(p: Parameters) -> RuleResult:
    """The markers' pockets leave material below them."""
    return RuleResult(
        p.depth - p.marker_height - MIN_DEPTH_LEFT,
        f"marker_height {p.marker_height:g} mm goes through the finger: depth {p.depth:g} mm less "
        f"{MIN_DEPTH_LEFT} mm is the most",
    )


WALLS = ("front_thickness", "back_thickness", "tip_length", "base_width")
RIBS = ("rib_count", "rib_thickness", "rib_angle", "height")
RULES: tuple[Rule, ...] = (
    Rule(cavity_length, ("tip_length", "base_thickness", "height")),
    Rule(cavity_open, WALLS),
    Rule(ribs_apart, RIBS),
    Rule(ribs_clear_of_base, ("rib_angle", "rib_count", "rib_thickness", "base_width", "height")),
    Rule(ribs_clear_of_tip, (*RIBS, "tip_length")),
    Rule(contact_on_front, ("contact_position", "contact_width", "height")),
    Rule(fillets_fit, ("fillet_radius", "rib_count")),
    Rule(markers_fit, ("marker_diameter", "marker_count", "front_thickness", "back_thickness")),
    Rule(markers_apart, ("marker_count", "marker_diameter", "rib_count")),
    Rule(markers_not_through, ("marker_height", "depth")),
)
"""In the order of checking: the later ones presuppose the earlier ones."""


def _cavity_width(p: Parameters, number: int, fault: str) -> RuleResult:
    """Result for the narrower end of the first or last cavity."""
    base_front, base_back, tip_back, tip_front = finger_section(p).cavities[number]
    front, back = tip_front[0] - base_front[0], tip_back[0] - base_back[0]
    wall, width = ("front", front) if front < back else ("back", back)
    return RuleResult(
        float(width) - MIN_CAVITY if p.rib_count else np.inf,
        f"{fault}: with {p.rib_count} ribs of {p.rib_thickness:g} mm at {p.rib_angle:g} deg the cavity "
        f"between them is {width:.3g} mm wide at the {wall} wall, at least {MIN_CAVITY} mm is needed",
    )

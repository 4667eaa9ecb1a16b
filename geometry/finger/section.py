"""The finger's section from its parameters, in closed form: walls, ribs and cavities; no CAD."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from pinnray.geometry.finger.parameters import Parameters
from pinnray.geometry.section.loop import Loop, turns
from pinnray.geometry.section.section import Section
from pinnray.runtime.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Line:
    """A straight line, or several, through points, shape (..., 2), mm, along a unit vector, shape (2,)."""

    point: FloatArray
    direction: FloatArray

    def meets(self, other: "Line") -> FloatArray:
        """The points where the lines cross another, shape (..., 2), mm; far away where they are parallel."""
        across = np.array([-other.direction[1], other.direction[0]])
        closing = float(self.direction @ across)
        if abs(closing) < 1e-9:
            closing = 1e-9
        share = (other.point - self.point) @ across / closing
        return np.asarray(self.point + share[..., None] * self.direction, dtype=np.float64)


@lru_cache(maxsize=64)
def finger_section(p: Parameters) -> Section:
    """The section of a finger whose parameters obey the rules.

    The outline has the pieces `base`, `back`, `tip` and `front`, with a foot `foot`.
    """
    cavities = tuple(_rounded(cell, p.fillet_radius).reversed() for cell in cells(p))
    return Section(finger_outline(p), cavities)


def front_line(distance: float) -> Line:
    """The line `distance` mm inside the front face."""
    return Line(np.array([0.0, -distance]), np.array([1.0, 0.0]))


def base_line(p: Parameters, distance: float) -> Line:
    """The line `distance` mm inside the base line, toward the back."""
    inward, along = _base_frame(p)
    return Line(distance * inward, along)


@lru_cache(maxsize=64)
def back_line(p: Parameters, distance: float) -> Line:
    """The line `distance` mm inside the back face, toward the tip."""
    base, apex = base_corners(p)[1], np.array([p.height, 0.0])
    along = (apex - base) / np.linalg.norm(apex - base)
    return Line(apex + distance * np.array([-along[1], along[0]]), along)


def tip_line(p: Parameters) -> Line:
    """The line between cavities and tip, parallel to the base, `tip_length` from the apex along the front."""
    _, along = _base_frame(p)
    return Line(np.array([p.height - p.tip_length, 0.0]), along)


def base_corners(p: Parameters) -> FloatArray:
    """Front and back end of the base line, shape (2, 2), mm."""
    _, along = _base_frame(p)
    return np.array([[0.0, 0.0], p.base_width * along])


@lru_cache(maxsize=64)
def cells(p: Parameters) -> tuple[FloatArray, ...]:
    """Cavities from base to tip with sharp corners, each of shape (4, 2), mm, counter-clockwise.

    Corners: front and back one near the base, then back and front one near the tip.
    """
    half = p.rib_thickness / (2 * np.cos(np.radians(rib_slope(p))))
    sides_of_ribs = _rib_lines(p, (rib_feet(p)[:, None] + (-half, half)).ravel())
    lines = (base_line(p, p.base_thickness), sides_of_ribs, tip_line(p))
    walls = (front_line(p.front_thickness), back_line(p, p.back_thickness))
    sides = np.concatenate(
        [np.stack([line.meets(wall) for wall in walls], axis=-2).reshape(-1, 2, 2) for line in lines]
    )
    return tuple(np.concatenate([sides[::2], sides[1::2, ::-1]], axis=1))


def rib_feet(p: Parameters) -> FloatArray:
    """Abscissae of the rib axes on the front wall's inner face, shape (rib_count,), mm.

    Without `rib_start` and `rib_pitch`, equal pitch over the cavity's length there, which is an assumption:
    the paper gives no spacing.
    """
    start = cavity_ends(p)[0] + rib_pitch(p) if p.rib_start is None else p.rib_start
    return np.asarray(start + rib_pitch(p) * np.arange(p.rib_count), dtype=np.float64)


def rib_pitch(p: Parameters) -> float:
    """Distance of neighbouring rib axes along the front wall, mm."""
    if p.rib_pitch is not None:
        return p.rib_pitch
    start, end = cavity_ends(p)
    return (end - start) / (p.rib_count + 1)


@lru_cache(maxsize=64)
def cavity_ends(p: Parameters) -> tuple[float, float]:
    """Abscissae between which cavities and ribs lie along the front wall's inner face, mm."""
    inner = front_line(p.front_thickness)
    sides = base_line(p, p.base_thickness), tip_line(p)
    start, end = (float(inner.meets(side)[0]) for side in sides)
    return start, end


def rib_slope(p: Parameters) -> float:
    """Angle of the ribs from the front wall's normal, positive toward the tip, degrees."""
    return p.rib_angle + (p.base_tilt if p.rib_reference == "base" else 0.0)


def rib_axes(p: Parameters) -> FloatArray:
    """Ends of the rib axes on the front and the back wall's centre line, shape (rib_count, 2, 2), mm."""
    lines = _rib_lines(p, rib_feet(p))
    ends = (front_line(p.front_thickness / 2), back_line(p, p.back_thickness / 2))
    return np.stack([lines.meets(end) for end in ends], axis=1)


def apex_angle(p: Parameters) -> float:
    """Angle between front and back face, radians."""
    along = back_line(p, 0.0).direction
    return float(np.arctan2(along[1], along[0]))


def tip_tangent(p: Parameters) -> float:
    """Distance along the front and the back face from the apex to where the tip's rounding starts, mm."""
    return float(p.tip_radius / np.tan(apex_angle(p) / 2))


def corner_angles(corners: FloatArray) -> FloatArray:
    """Interior angle at every corner of a convex polygon of shape (n, 2), shape (n,), radians."""
    ahead, behind = np.roll(corners, -1, axis=0) - corners, np.roll(corners, 1, axis=0) - corners
    return turns(ahead, behind)


@lru_cache(maxsize=64)
def _base_frame(p: Parameters) -> tuple[FloatArray, FloatArray]:
    """Unit vectors from the base into the body and along it from front to back, each of shape (2,)."""
    tilt = np.radians(p.base_tilt)
    return np.array([np.cos(tilt), np.sin(tilt)]), np.array([np.sin(tilt), -np.cos(tilt)])


def _rib_lines(p: Parameters, feet: FloatArray) -> Line:
    """Lines along the ribs through abscissae, shape (n,), mm, of the front wall's inner face."""
    angle = np.radians(rib_slope(p))
    along = np.array([np.sin(angle), -np.cos(angle)])  # from front to back
    return Line(np.stack([feet, np.full_like(feet, -p.front_thickness)], axis=-1), along)


def finger_outline(p: Parameters) -> Loop:
    """The outline from the base's front corner, counter-clockwise."""
    apex, tangent = np.array([p.height, 0.0]), tip_tangent(p)
    pieces = [*_base_side(p), (base_corners(p)[1], 0.0, "back")]
    if tangent > 0:
        rounding = float(np.tan((np.pi - apex_angle(p)) / 4))
        pieces.append((apex - tangent * back_line(p, 0.0).direction, rounding, "tip"))
    pieces.append((np.array([p.height - tangent, 0.0]), 0.0, "front"))
    points, bulges, names = zip(*pieces, strict=True)
    return Loop(np.array(points), np.array(bulges), names)


def _base_side(p: Parameters) -> list[tuple[FloatArray, float, str]]:
    """Start, bulge and name of the pieces from the base line's front end to its back end."""
    front = base_corners(p)[0]
    if p.foot_height == 0:
        return [(front, 0.0, "base")]
    inward, along = _base_frame(p)
    ends = [(0.0, p.foot_height), (p.base_width, p.foot_height)]
    names = ["foot", "base", "foot"]
    if p.slot_width > 0:
        edges = [
            (p.base_width + side * width) / 2 for width in (p.slot_opening, p.slot_width) for side in (-1, 1)
        ]
        lip, top = p.foot_height - p.lip_thickness, p.foot_height - p.lip_thickness - p.slot_height
        slot = [(edges[0], p.foot_height), (edges[0], lip), (edges[2], lip), (edges[2], top)]
        slot += [(edges[3], top), (edges[3], lip), (edges[1], lip), (edges[1], p.foot_height)]
        ends = [ends[0], *slot, ends[1]]
        names = ["foot", "base", *["slot"] * 7, "base", "foot"]
    corners = [front, *(share * along - out * inward for share, out in ends)]
    # A slot as wide as its opening has pieces of no length.
    kept = [*(np.linalg.norm(np.diff(corners, axis=0), axis=1) > 1e-9), True]
    return [(corner, 0.0, name) for corner, name, each in zip(corners, names, kept, strict=True) if each]


def tip_middle(p: Parameters) -> FloatArray:
    """The middle of the solid tip, on the bisector of the apex, shape (2,), mm.

    It is half way, in x, between the tip line's front end and the rounding's extreme point.
    """
    half = apex_angle(p) / 2
    cut = p.tip_radius * (1 / np.sin(half) - 1) * np.cos(half)
    from_apex = (p.tip_length + cut) / 2
    return np.array([p.height - from_apex, -from_apex * np.tan(half)])


def _rounded(corners: FloatArray, radius: float) -> Loop:
    """A convex counter-clockwise polygon, shape (n, 2), mm, with its corners rounded."""
    if radius == 0:
        return Loop.polygon(corners)
    angles = corner_angles(corners)
    behind, ahead = np.roll(corners, 1, axis=0) - corners, np.roll(corners, -1, axis=0) - corners
    tangent = (radius / np.tan(angles / 2))[:, None]
    enter = corners + tangent * behind / np.linalg.norm(behind, axis=1, keepdims=True)
    leave = corners + tangent * ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
    bulges = np.stack([np.tan((np.pi - angles) / 4), np.zeros_like(angles)], axis=1)
    return Loop(np.stack([enter, leave], axis=1).reshape(-1, 2), bulges.ravel(), ("",) * (2 * len(corners)))

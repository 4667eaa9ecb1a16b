"""The finger's section in closed form: outline, cavities, ribs, fillets and markers; no CAD."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from geometry.arrays import BoolArray, FloatArray
from geometry.finger.parameters import Parameters


@dataclass(frozen=True, eq=False)
class Section:
    """Outline and cavities of a finger.

    Attributes:
        outer: Corners (0, 0), (0, -base_width), (height, 0), shape (3, 2), mm; counter-clockwise.
        cavities: From base to tip with sharp corners, each of shape (4, 2), mm, counter-clockwise: front and
            back corner nearer the base, back and front corner nearer the tip.
        ribs: Between the walls' inner faces, corners in the order of `cavities`, each of shape (4, 2), mm.
        fillet_radius: Radius that rounds every corner of every cell, mm.
        contact: Both ends of the contact on the front face, shape (2, 2), mm.
    """

    outer: FloatArray
    cavities: tuple[FloatArray, ...]
    ribs: tuple[FloatArray, ...]
    fillet_radius: float
    contact: FloatArray

    def contains(self, points: FloatArray) -> BoolArray:
        """Mask of the points, shape (n, 2), mm, in the body or on its boundary; fillets are ignored."""
        inside = inside_distance(self.outer, points) >= 0
        for cavity in self.cavities:
            inside &= inside_distance(cavity, points) <= 0
        return inside


def finger_section(parameters: Parameters) -> Section:
    """The section of a finger whose parameters obey the rules."""
    p = parameters
    half = p.rib_thickness / (2 * np.cos(np.radians(p.rib_angle)))
    sides = [_wall_side(p, p.base_thickness)]
    for foot in rib_feet(p):
        sides += [_rib_side(p, foot - half), _rib_side(p, foot + half)]
    sides.append(_wall_side(p, p.height - p.tip_length))
    quads = [np.array([*left, *right[::-1]]) for left, right in pairwise(sides)]
    return Section(
        outer=np.array([[0, 0], [0, -p.base_width], [p.height, 0]], dtype=np.float64),
        cavities=tuple(quads[::2]),
        ribs=tuple(quads[1::2]),
        fillet_radius=p.fillet_radius,
        contact=np.array([[x, 0] for x in p.contact_ends], dtype=np.float64),
    )


def rib_feet(parameters: Parameters) -> FloatArray:
    """Abscissae of the rib axes on the front wall's inner face, shape (rib_count,), mm.

    Equal pitch over the cavity's length there, which is an assumption: the paper gives no spacing.
    """
    p = parameters
    return p.base_thickness + rib_pitch(p) * np.arange(1, p.rib_count + 1)


def rib_pitch(parameters: Parameters) -> float:
    """Distance of neighbouring rib axes along the front wall, mm."""
    p = parameters
    return (p.height - p.tip_length - p.base_thickness) / (p.rib_count + 1)


def rib_direction(parameters: Parameters) -> FloatArray:
    """Unit vector along the ribs from front to back, shape (2,).

    A positive angle leans toward the tip: x grows from the front wall to the back wall.
    """
    angle = np.radians(parameters.rib_angle)
    return np.array([np.sin(angle), -np.cos(angle)])


def rib_axes(parameters: Parameters) -> FloatArray:
    """Ends of the rib axes on the front and the back wall's centre line, shape (rib_count, 2, 2), mm."""
    p = parameters
    direction = rib_direction(p)
    axes = np.empty((p.rib_count, 2, 2))
    for axis, foot in zip(axes, rib_feet(p), strict=True):
        start = np.array([foot, -p.front_thickness])
        axis[0] = start + direction * (p.front_thickness / 2) / direction[1]
        axis[1] = _to_back(p, start, direction, p.back_thickness / 2)
    return axes


def marker_positions(parameters: Parameters) -> FloatArray:
    """Centres of the markers, ordered from base to tip, shape (m, 2), mm.

    `front`: `marker_count` of them on the front wall's centre line at x = height k / (marker_count + 1).
    `joints`: where each rib's axis meets either wall's centre line, and one in the tip on the bisector of the
    apex, half the tip's length from it: 2 rib_count + 1.

    Both layouts are assumptions: the paper shows nine markers, printed with the finger, without positions.
    """
    p = parameters
    if p.marker_layout == "front":
        x = p.height * np.arange(1, p.marker_count + 1) / (p.marker_count + 1)
        return np.stack([x, np.full_like(x, -p.front_thickness / 2)], axis=1)
    half_angle = np.arctan2(p.base_width, p.height) / 2
    tip = np.array([p.height - p.tip_length / 2, -p.tip_length / 2 * np.tan(half_angle)])
    points = np.concatenate([rib_axes(p).reshape(-1, 2), tip[None]])
    return np.asarray(points[np.lexsort((-points[:, 1], points[:, 0]))], dtype=np.float64)


def back_offset_line(parameters: Parameters, distance: float) -> tuple[float, float]:
    """Slope and intercept, mm, of the line y = slope * x + intercept `distance` mm inside the back face."""
    p = parameters
    slope = p.base_width / p.height
    return slope, -p.base_width + distance * float(np.hypot(1, slope))


def polygon_sides(corners: FloatArray) -> FloatArray:
    """Length of every side of a polygon of shape (n, 2), from each corner to the next, shape (n,), mm."""
    return np.asarray(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1), dtype=np.float64)


def corner_angles(corners: FloatArray) -> FloatArray:
    """Interior angle at every corner of a convex polygon of shape (n, 2), shape (n,), radians."""
    ahead, behind = np.roll(corners, -1, axis=0) - corners, np.roll(corners, 1, axis=0) - corners
    cross = ahead[:, 0] * behind[:, 1] - ahead[:, 1] * behind[:, 0]
    return np.asarray(np.arctan2(cross, (ahead * behind).sum(axis=1)), dtype=np.float64)


def fillet_points(corners: FloatArray, which: int, radius: float) -> FloatArray:
    """Start, middle and end of the fillet at corner `which` of a convex polygon, shape (3, 2), mm."""
    corner, (behind, ahead) = corners[which], _along_sides(corners, which)
    tangent = radius / np.tan(corner_angles(corners)[which] / 2)
    centre = fillet_centre(corners, which, radius)
    middle = centre + radius * (corner - centre) / np.linalg.norm(corner - centre)
    return np.array([corner + behind * tangent, middle, corner + ahead * tangent])


def fillet_centre(corners: FloatArray, which: int, radius: float) -> FloatArray:
    """Centre of the fillet at corner `which` of a convex polygon, shape (2,), mm."""
    bisector = _along_sides(corners, which).sum(axis=0)
    distance = radius / np.sin(corner_angles(corners)[which] / 2)
    return np.asarray(corners[which] + distance * bisector / np.linalg.norm(bisector), dtype=np.float64)


def inside_distance(corners: FloatArray, points: FloatArray) -> FloatArray:
    """Distance of points (n, 2) inside a convex counter-clockwise polygon, (n,), mm; negative outside.

    Outside, it is the distance to the nearest side's line: never more than the true distance.
    """
    ahead = np.roll(corners, -1, axis=0) - corners
    ahead = ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
    apart = points[:, None] - corners
    return np.asarray((ahead[:, 0] * apart[..., 1] - ahead[:, 1] * apart[..., 0]).min(axis=1))


def _along_sides(corners: FloatArray, which: int) -> FloatArray:
    """Unit vectors from a corner to the one before and the one after it, shape (2, 2)."""
    sides = corners[[which - 1, (which + 1) % len(corners)]] - corners[which]
    return np.asarray(sides / np.linalg.norm(sides, axis=1, keepdims=True), dtype=np.float64)


def _wall_side(p: Parameters, x: float) -> tuple[FloatArray, FloatArray]:
    """Front and back end of the vertical side of the cavity at `x`."""
    slope, intercept = back_offset_line(p, p.back_thickness)
    return np.array([x, -p.front_thickness]), np.array([x, slope * x + intercept])


def _rib_side(p: Parameters, x: float) -> tuple[FloatArray, FloatArray]:
    """Front and back end of the rib's side that starts at `x` on the front wall's inner face."""
    start = np.array([x, -p.front_thickness])
    return start, _to_back(p, start, rib_direction(p), p.back_thickness)


def _to_back(p: Parameters, start: FloatArray, direction: FloatArray, distance: float) -> FloatArray:
    """From `start` along `direction` to the line `distance` mm inside the back face."""
    slope, intercept = back_offset_line(p, distance)
    closing = max(slope * direction[0] - direction[1], 1e-9)  # zero where a rib is parallel to the back wall
    return np.asarray(
        start + direction * (start[1] - slope * start[0] - intercept) / closing, dtype=np.float64
    )

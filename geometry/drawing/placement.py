"""Rotation, reflection and shift of a drawing into the finger's frame; names of the parts of its outline."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pinnray.geometry.drawing.formats.closed_loops import between
from pinnray.geometry.drawing.formats.drawing import place
from pinnray.geometry.section.loop import STRAIGHT, Loop
from pinnray.geometry.section.section import Section
from pinnray.geometry.section.thickness import inner_normals
from pinnray.runtime.arrays import FloatArray, frozen_array
from pinnray.runtime.errors import UserError

STEEPEST = np.radians(60)
"""Largest angle of the front's normal from the contact's."""

ROUND = 12
"""Decimals, mm, to which placed corners are rounded: removes the rotation's rounding."""


@dataclass(frozen=True, eq=False)
class Placement:
    """x -> matrix x + shift, with a rotation, also reflected, (2, 2), and a shift (2,), mm."""

    matrix: FloatArray
    shift: FloatArray

    def __post_init__(self) -> None:
        for name, shape in (("matrix", (2, 2)), ("shift", (2,))):
            values = frozen_array(getattr(self, name), dtype=np.float64, shape=shape, name=name)
            object.__setattr__(self, name, values)

    def __call__(self, points: ArrayLike) -> FloatArray:
        """Points of the drawing, shape (n, 2), mm, in the finger's frame."""
        moved = np.asarray(points, dtype=np.float64) @ self.matrix.T + self.shift
        return np.asarray(np.round(moved, ROUND) + 0.0)

    @property
    def mirrored(self) -> bool:
        """Whether it reflects."""
        return bool(np.linalg.det(self.matrix) < 0)

    @property
    def inverse(self) -> "Placement":
        """From the finger's frame into the drawing's."""
        return Placement(self.matrix.T, -self.matrix.T @ self.shift)

    def section(self, section: Section) -> Section:
        """The section in the finger's frame."""
        placed = section.transformed(self.matrix, self.shift)
        return Section(_rounded(placed.outline), tuple(_rounded(cavity) for cavity in placed.cavities))

    def __str__(self) -> str:
        """In words, such as `mirrored in x, turned by 90 degrees, shifted by (3, 4) mm`."""
        turn = self.matrix @ np.diag([-1.0 if self.mirrored else 1.0, 1.0])
        angle = float(np.degrees(np.arctan2(turn[1, 0], turn[0, 0])))
        x, y = self.shift.round(9) + 0.0
        mirrored = "mirrored in x, " if self.mirrored else ""
        return f"{mirrored}turned by {round(angle, 9) + 0.0:.6g} degrees, shifted by ({x:.6g}, {y:.6g}) mm"


def placed(section: Section, which: int, fraction: float) -> tuple[Section, Placement]:
    """The section in the finger's frame, with its pieces `front` and `back` named.

    Args:
        section: With its pieces `base`, in the drawing's frame, mm.
        which: Piece of the outline that the contact's middle is on.
        fraction: Place of the middle on it.
    """
    contact = section.outline.along(which, fraction)[0]
    x, y = -inner_normals(section.outline, which, fraction)[0]
    if not section.outline.bulges[which]:  # without the rounding of an angle
        start, end = section.outline.ends[which]
        x, y = np.array([end[1] - start[1], start[0] - end[0]]) / np.linalg.norm(end - start)
    matrix = np.array([[y, -x], [x, y]])
    base = list(section.outline.pieces("base"))
    middles = np.concatenate([section.outline.along(each, 0.5) for each in base]) @ matrix.T
    lengths = section.outline.lengths[base]
    beyond = lengths @ middles[:, 0] / lengths.sum() - (matrix @ contact)[0]
    if beyond > 0.01 * float(np.ptp(section.bounds, axis=0).max()):
        matrix = np.diag([-1.0, 1.0]) @ matrix
    turned = Placement(matrix + 0.0, np.array([0.0, -(matrix @ contact)[1]]))
    section = turned.section(section)
    touched = turned(contact[None])[0]
    outline = with_back(with_front(section.outline, touched))
    placement = Placement(turned.matrix, turned.shift - (base_start(outline)[0], 0.0))
    shifted = Placement(np.eye(2), placement.shift - turned.shift)
    return shifted.section(Section(outline, section.cavities)), placement


def _rounded(loop: Loop) -> Loop:
    return Loop(np.round(loop.points, ROUND) + 0.0, loop.bulges, loop.names)


def with_part(loop: Loop, ends: FloatArray, name: str) -> Loop:
    """The curve with a name for its part between two points, (2, 2), the shorter way, mm."""
    for point in ends:
        on_curve(loop, point, name)
    loop, ways = between(loop, ends)
    shorter = min(ways, key=lambda way: float(loop.lengths[way].sum()))
    if not shorter:
        raise UserError(
            f"the {name} at {place(ends[0])} has no length; give two different points of the outline"
        )
    return loop.renamed((name if which in shorter else own for which, own in enumerate(loop.names)))


def on_curve(loop: Loop, point: FloatArray, name: str) -> tuple[int, float]:
    """Piece and fraction of its length at a given point of the outline, at most 0.1 mm off the curve."""
    (which,), (fraction,), (distance,) = loop.places(np.asarray(point)[None])
    if distance > 0.1:
        nearest = loop.along(which, fraction)[0]
        raise UserError(
            f"the {name} at {place(point)} is {distance:.3g} mm off the outline; its nearest point is "
            f"{place(nearest)}"
        )
    return int(which), float(fraction)


def with_front(loop: Loop, contact: FloatArray) -> Loop:
    """The outline with its pieces `front`: the part around the contact whose normals are near +y.

    Normals of up to `STEEPEST` from +y count, so that x falls along the part; arcs are cut there. It ends
    at a clamped piece.
    """
    which = int(loop.places(contact[None]).pieces[0])
    for step in (1, -1):
        current = which
        for _ in range(len(loop.points)):
            cuts = _crossings(loop, current)
            if cuts:
                loop = loop.split(current, cuts)
                break
            following = (current + step) % len(loop.points)
            if not _faces(loop, current) or loop.names[following] == "base":
                break
            current = following
        which = int(loop.places(contact[None]).pieces[0])
    facing = {each for each, name in enumerate(loop.names) if name != "base" and _faces(loop, each)}
    run = next(run for run in loop.runs({which, *facing}) if which in run)
    return loop.renamed(("front" if number in run else own for number, own in enumerate(loop.names)))


def with_back(loop: Loop) -> Loop:
    """The outline with the name `back` for its longest straight piece opposite to the front, if long."""
    front = [loop.ends[which][:, 0] for which in loop.pieces("front")]
    reach = np.ptp(np.concatenate(front))
    long = [which for which in loop.straight.tolist() if loop.lengths[which] > 0.5 * reach]
    free = [which for which in long if not loop.names[which] and inner_normals(loop, which, 0.5)[0, 1] > 0.5]
    return loop.named(max(free, key=lambda which: loop.lengths[which]), "back") if free else loop


def base_start(loop: Loop) -> FloatArray:
    """The first corner of the base after the front, shape (2,), mm."""
    front = list(loop.pieces("front"))
    count = len(loop.points)
    last = next(which for which in front if (which + 1) % count not in front)
    order = [(last + 1 + step) % count for step in range(count)]
    return np.asarray(loop.points[next(which for which in order if loop.names[which] == "base")])


def _slopes(loop: Loop, which: int) -> tuple[float, float]:
    """Angles of the outer normal from +y at both ends of a piece, the first within half a turn."""
    x, y = -inner_normals(loop, which, 0.0)[0]
    first = float(np.arctan2(-x, y))
    return first, first + 4 * float(np.arctan(loop.bulges[which]))


def _faces(loop: Loop, which: int) -> bool:
    return all(abs(angle) <= STEEPEST + 1e-9 for angle in _slopes(loop, which))


def _crossings(loop: Loop, which: int) -> list[float]:
    """Fractions of an arc's length at which its normal is `STEEPEST` from +y."""
    if abs(loop.bulges[which]) <= STRAIGHT:
        return []
    first, last = _slopes(loop, which)
    turns = 2 * np.pi * np.array([-1, 0, 1])
    limits = np.concatenate([turns + STEEPEST, turns - STEEPEST])
    fractions = (limits - first) / (last - first)
    return sorted(float(share) for share in fractions if 1e-6 < share < 1 - 1e-6)

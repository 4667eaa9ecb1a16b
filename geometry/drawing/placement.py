"""Rotation, reflection and shift of a drawing into the finger's frame."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from geometry.arrays import FloatArray, frozen_array
from geometry.drawing.outline import base_start, with_back, with_front
from geometry.section.loop import Loop
from geometry.section.section import Section
from geometry.section.thickness import inner_normals

MIRROR = 0.01
"""Least distance of the base's middle beyond the contact for a reflection, as a share of the extent."""

ROUND = 12
"""Decimals, mm, to which placed corners are rounded: removes the rotation's rounding."""


@dataclass(frozen=True, eq=False)
class Placement:
    """x -> matrix x + shift.

    Attributes:
        matrix: Rotation, or rotation and reflection, shape (2, 2).
        shift: Shape (2,), mm.
    """

    matrix: FloatArray
    shift: FloatArray

    def __post_init__(self) -> None:
        matrix = frozen_array(self.matrix, dtype=np.float64, shape=(2, 2), name="matrix")
        object.__setattr__(self, "matrix", matrix)
        object.__setattr__(
            self, "shift", frozen_array(self.shift, dtype=np.float64, shape=(2,), name="shift")
        )

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
        """In words, such as `turned by 90 degrees, mirrored, shifted by (3, 4) mm`."""
        turn = self.matrix @ np.diag([-1.0 if self.mirrored else 1.0, 1.0])
        angle = float(np.degrees(np.arctan2(turn[1, 0], turn[0, 0])))
        words = ["mirrored in x"] if self.mirrored else []
        words += [f"turned by {angle:.6g} degrees"] if abs(angle) > 1e-9 else []
        x, y = (float(value) + 0.0 for value in np.round(self.shift, 9))
        words += [f"shifted by ({x:.6g}, {y:.6g}) mm"] if x or y else []
        return ", ".join(words) or "none"


def placed(section: Section, which: int, fraction: float) -> tuple[Section, Placement]:
    """The section in the finger's frame, with its pieces `front` and `back` named.

    Args:
        section: With its pieces `base`, in the drawing's frame, mm.
        which: Piece of the outline that the contact's middle is on.
        fraction: Place of the middle on it.

    Returns:
        The section and its placement.
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
    if beyond > MIRROR * float(np.ptp(section.bounds, axis=0).max()):
        matrix = np.diag([-1.0, 1.0]) @ matrix
    turned = Placement(matrix + 0.0, np.array([0.0, -(matrix @ contact)[1]]))
    section = turned.section(section)
    touched = turned(contact[None])[0]
    outline = with_back(with_front(section.outline, touched))
    placement = Placement(turned.matrix, turned.shift - (base_start(outline)[0], 0.0))
    shift = placement.shift - turned.shift
    outline = _rounded(outline.transformed(np.eye(2), shift))
    cavities = tuple(_rounded(cavity.transformed(np.eye(2), shift)) for cavity in section.cavities)
    return Section(outline, cavities), placement


def _rounded(loop: Loop) -> Loop:
    return Loop(np.round(loop.points, ROUND) + 0.0, loop.bulges, loop.names)

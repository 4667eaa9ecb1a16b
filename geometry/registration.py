"""Frames of pictures: how well they are known, and the similarities by which they are off.

A point at rest is measured at X, in a picture that a similarity D takes to the drawing; pressed it is
measured at x, in a picture to which a similarity B takes the picture at rest. A finger with the
displacement u then shows

    x - X = B(D^-1(D(X) + u(D(X)))) - X
"""

import re
from dataclasses import dataclass
from math import inf

import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError


@dataclass(frozen=True)
class Registration:
    """How well a picture's frame is known: standard deviations of a similarity about the markers' middle.

    Raises:
        UserError: If one of them is negative or infinite.
    """

    turn: float = 0.0  #: Degrees.
    shift: float = 0.0  #: Of each component, mm.
    scale: float = 0.0  #: A share: 0.01 is one per cent.

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0 <= value < inf:
                raise UserError(f"the {name} of a picture must be known to zero or more, got {value:g}")

    @property
    def fixed(self) -> bool:
        """True if the frame is known exactly."""
        return not (self.turn or self.shift or self.scale)

    @classmethod
    def parse(cls, text: str) -> "Registration":
        """Read `fixed`, `free`, or `turn 2 deg, shift 0.3 mm, scale 1 %`, or some of these parts.

        Raises:
            UserError: If the text says something else.
        """
        if text.strip().lower() in (names := {"fixed": FIXED, "free": FREE}):
            return names[text.strip().lower()]
        found = {}
        for part in text.split(","):
            known = re.fullmatch(r"\s*(turn|shift|scale)\s+([0-9.eE+-]+)\s*(deg|mm|%)\s*", part)
            if (
                known is None
                or known[1] in found
                or {"turn": "deg", "shift": "mm", "scale": "%"}[known[1]] != known[3]
            ):
                break
            try:
                found[known[1]] = float(known[2]) / (100 if known[3] == "%" else 1)
            except ValueError:
                break
        else:
            return cls(**found)
        raise UserError(
            f"{text.strip()!r} is neither fixed, free nor like 'turn 2 deg, shift 0.3 mm, scale 1 %'"
        )

    def __str__(self) -> str:
        if self.fixed:
            return "fixed"
        return f"turn {self.turn:g} deg, shift {self.shift:g} mm, scale {100 * self.scale:g} %"


FIXED = Registration()
"""Of a picture in whose frame lengths and directions are known."""
FREE = Registration(turn=10.0, shift=5.0, scale=0.05)
"""Of a picture in whose frame little more is known than which side is up."""
HAND_HELD = Registration(turn=5.0, shift=1.0, scale=0.02)
"""Of a photograph by hand from about the place of another one: pictures of real fingers were turned by 2 to 5
degrees."""


@dataclass(frozen=True, eq=False)
class Similarity:
    """A turn and a change of scale about a centre, then a shift."""

    centre: FloatArray  # Shape (2,), mm
    values: FloatArray  # Turn, degrees; shift along x and y, mm; change of scale, a share: shape (4,)

    def moved(self, points: FloatArray) -> FloatArray:
        """New places of points, both of shape (n, 2), mm."""
        added = self.matrix - np.eye(2)
        return np.asarray(points + (self.values[1:3] + (points - self.centre) @ added.T))

    def undone(self, points: FloatArray) -> FloatArray:
        """Places from which points, shape (n, 2), mm, come."""
        back = np.linalg.inv(self.matrix)
        shift = back @ self.values[1:3]
        return np.asarray(points + ((points - self.centre) @ (back - np.eye(2)).T - shift))

    def slopes(self, points: FloatArray) -> FloatArray:
        """Derivatives (4, n, 2) of the new places of points, shape (n, 2), by the values."""
        offset, degree = points - self.centre, np.pi / 180
        quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
        by_shift = np.broadcast_to(np.eye(2)[:, None], (2, *points.shape))
        by_turn, by_scale = (
            degree * offset @ (quarter @ self.matrix).T,
            offset @ self.matrix.T / (1 + self.values[3]),
        )
        return np.concatenate([by_turn[None], by_shift, by_scale[None]])

    @property
    def matrix(self) -> FloatArray:
        """The scaled rotation, shape (2, 2)."""
        turn = np.radians(self.values[0])
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        return np.asarray((1 + self.values[3]) * rotation)


@dataclass(frozen=True, eq=False)
class Pictures:
    """The similarities between two pictures and the drawing."""

    pressed: Similarity  # Takes the picture at rest to the pressed one
    drawn: Similarity  # Takes the picture at rest to the drawing

    def shown(self, points: FloatArray, displacement: FloatArray) -> FloatArray:
        """What pictures show of the displacement of points, all of shape (n, 2), mm."""
        seen = self.drawn.undone(self.drawn.moved(points) + displacement)
        return np.asarray(self.pressed.moved(seen) - points)

    def own(self, points: FloatArray, shown: FloatArray) -> FloatArray:
        """The displacement in the drawing of which pictures show `shown`, all of shape (n, 2), mm."""
        return self.drawn.moved(self.pressed.undone(points + shown)) - self.drawn.moved(points)

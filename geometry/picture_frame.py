"""Frames of pictures: how well they are known, and the homographies by which they are off.

A point at rest is measured at X, in a picture that a homography D takes to the drawing; pressed it is
measured at x, in a picture to which a homography B takes the picture at rest. A finger with the
displacement u then shows

    x - X = B(D^-1(D(X) + u(D(X)))) - X
"""

import re
from dataclasses import dataclass
from math import inf

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError

PARTS = {"turn": "deg", "shift_x": "mm", "shift_y": "mm", "scale": "", "tilt_x": "", "tilt_y": ""}
"""Values of a homography, with their units."""
TILTED = 100.0
"""Distance across which a tilt changes the scale by its value, mm."""
_UNITS = {"turn": "deg", "shift": "mm", "scale": "%", "tilt": "% per 100 mm"}


@dataclass(frozen=True)
class Registration:
    """How well a picture's frame is known: standard deviations of a homography about the markers' middle.

    Raises:
        UserError: If one of them is negative or infinite.
    """

    turn: float = 0.0  #: Degrees.
    shift: float = 0.0  #: Of each component, mm.
    scale: float = 0.0  #: A share: 0.01 is one per cent.
    tilt: float = 0.0  #: Of the plane: change of the scale across 100 mm in each direction, a share.

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0 <= value < inf:
                raise UserError(f"the {name} of a picture must be known to zero or more, got {value:g}")

    @property
    def fixed(self) -> bool:
        """True if the frame is known exactly."""
        return not (self.turn or self.shift or self.scale or self.tilt)

    @property
    def deviations(self) -> FloatArray:
        """In the order of `PARTS`, shape (6,)."""
        return np.array([self.turn, self.shift, self.shift, self.scale, self.tilt, self.tilt])

    @classmethod
    def parse(cls, text: str) -> "Registration":
        """Read `fixed`, `free`, or `turn 2 deg, shift 0.3 mm, scale 1 %, tilt 1 % per 100 mm`, or some parts.

        Raises:
            UserError: If the text says something else.
        """
        if text.strip().lower() in (names := {"fixed": FIXED, "free": FREE}):
            return names[text.strip().lower()]
        found = {}
        for part in text.split(","):
            known = re.fullmatch(r"\s*(\w+)\s+([0-9.eE+-]+)\s*(\S.*?)\s*", part)
            if known is None or known[1] in found or _UNITS.get(known[1]) != known[3]:
                break
            try:
                found[known[1]] = float(known[2]) / (100 if known[3][0] == "%" else 1)
            except ValueError:
                break
        else:
            return cls(**found)
        raise UserError(
            f"{text.strip()!r} is neither fixed, free nor like 'turn 2 deg, shift 0.3 mm, scale 1 %, "
            "tilt 1 % per 100 mm'"
        )

    def __str__(self) -> str:
        if self.fixed:
            return "fixed"
        tilt = f", tilt {100 * self.tilt:g} % per 100 mm" if self.tilt else ""
        return f"turn {self.turn:g} deg, shift {self.shift:g} mm, scale {100 * self.scale:g} %{tilt}"


FIXED = Registration()
"""Of a picture in whose frame lengths and directions are known."""
FREE = Registration(turn=10.0, shift=5.0, scale=0.05, tilt=0.02)
"""Of a picture in whose frame little more is known than which side is up."""
HAND_HELD = Registration(turn=5.0, shift=1.0, scale=0.02, tilt=0.01)
"""Of a photograph by hand from about the place of another one: pictures of real fingers were turned by 2 to 5
degrees. A camera that is 0.4 m away and tilted by 2.3 degrees more changes the scale by 1 % per 100 mm."""


@dataclass(frozen=True, eq=False)
class Homography:
    """A tilt, a turn and a change of scale about a centre, then a shift; without tilt it is a similarity.

    A point at the distance d from the centre c is taken to c + s + M d / (1 - t · d), with the shift s, the
    scaled rotation M and the tilt t per length.
    """

    centre: FloatArray  # Shape (2,), mm
    values: FloatArray  # Those of `PARTS`, shape (6,)

    def moved(self, points: FloatArray) -> FloatArray:
        """New places of points, both of shape (n, 2), mm."""
        offset = points - self.centre
        return np.asarray(points + (self.values[1:3] + (self._turned(offset) - offset)))

    def undone(self, points: FloatArray) -> FloatArray:
        """Places from which points, shape (n, 2), mm, come."""
        shifted = points - self.values[1:3]
        offset = shifted - self.centre
        back = offset @ np.linalg.inv(self._matrix).T
        back /= 1 + back @ self._tilt[:, None]
        return np.asarray(shifted + (back - offset))

    def jacobians(self, points: FloatArray) -> FloatArray:
        """Derivatives (n, 2, 2) of the new places of points, shape (n, 2), by the points."""
        turned, nearer = self._turned(points - self.centre), self._nearer(points - self.centre)
        bent = turned[:, :, None] * self._tilt
        return np.asarray((self._matrix + bent) * nearer[:, :, None])

    def slopes(self, points: FloatArray) -> FloatArray:
        """Derivatives (6, n, 2) of the new places of points, shape (n, 2), by the values."""
        offset = points - self.centre
        turned = self._turned(offset)
        by_turn = np.radians(1.0) * np.column_stack([-turned[:, 1], turned[:, 0]])
        by_shift = np.broadcast_to(np.eye(2)[:, None], (2, *points.shape))
        by_tilt = turned * (self._nearer(offset) * offset / TILTED).T[:, :, None]
        return np.concatenate([by_turn[None], by_shift, turned[None] / (1 + self.values[3]), by_tilt])

    def _turned(self, offset: FloatArray) -> FloatArray:
        """M d / (1 - t · d) of offsets d, shape (n, 2), mm."""
        return np.asarray(offset @ self._matrix.T * self._nearer(offset))

    def _nearer(self, offset: FloatArray) -> FloatArray:
        """1 / (1 - t · d) of offsets d, shape (n, 1)."""
        return np.asarray(1 / (1 - offset @ self._tilt[:, None]))

    @property
    def _tilt(self) -> FloatArray:
        """t, shape (2,), 1/mm."""
        return np.asarray(self.values[4:] / TILTED)

    @property
    def _matrix(self) -> FloatArray:
        """M, shape (2, 2)."""
        turn = np.radians(self.values[0])
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        return np.asarray((1 + self.values[3]) * rotation)


def nearest_similarity(points: FloatArray, places: FloatArray, *, rigid: bool = False) -> Homography:
    """The homography without tilt that takes points nearest to places, by least squares.

    Source: W. Kabsch, Acta Cryst. A 32 (1976) 922-923.

    Args:
        points: At least two that are not all the same, shape (n, 2), mm.
        places: Shape (n, 2), mm.
        rigid: Whether the scale stays.
    """
    centre, middle = points.mean(axis=0), places.mean(axis=0)
    here, there = ((each - own) @ [1, 1j] for each, own in ((points, centre), (places, middle)))
    factor = np.vdot(here, there) / np.vdot(here, here).real
    scale = 0.0 if rigid else abs(factor) - 1
    return Homography(centre, np.array([np.degrees(np.angle(factor)), *(middle - centre), scale, 0.0, 0.0]))


@dataclass(frozen=True, eq=False)
class Pictures:
    """The similarities between two pictures and the drawing."""

    pressed: Homography  # Takes the picture at rest to the pressed one
    drawn: Homography  # Takes the picture at rest to the drawing

    def shown(self, points: FloatArray, displacement: FloatArray) -> FloatArray:
        """What pictures show of the displacement of points, all of shape (n, 2), mm."""
        seen = self.drawn.undone(self.drawn.moved(points) + displacement)
        return np.asarray(self.pressed.moved(seen) - points)

    def jacobians(self, seen: FloatArray) -> FloatArray:
        """Derivatives (n, 2, 2) of what pictures show by the displacement.

        Args:
            seen: Places of the displaced points in the frame of the picture at rest, shape (n, 2), mm.
        """
        return self.pressed.jacobians(seen) @ np.linalg.inv(self.drawn.jacobians(seen))

    def own(self, points: FloatArray, shown: FloatArray) -> FloatArray:
        """The displacement in the drawing of which pictures show `shown`, all of shape (n, 2), mm."""
        return self.drawn.moved(self.pressed.undone(points + shown)) - self.drawn.moved(points)

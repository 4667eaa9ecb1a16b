"""Measured or simulated displacements of the markers."""

import re
from dataclasses import dataclass
from math import inf

import numpy as np

from geometry.arrays import BoolArray, FloatArray, frozen_array
from geometry.errors import ShapeError, UserError


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
        """Read `fixed`, `free`, or such as `turn 2 deg, shift 0.3 mm, scale 1 %`, of which all are optional.

        Raises:
            UserError: If the text says something else.
        """
        if text.strip().lower() in (names := {"fixed": FIXED, "free": FREE}):
            return names[text.strip().lower()]
        found = {}
        for part in text.split(","):
            known = re.fullmatch(r"\s*(turn|shift|scale)\s+([0-9.eE+-]+)\s*(deg|mm|%)\s*", part)
            if known is None or {"turn": "deg", "shift": "mm", "scale": "%"}[known[1]] != known[3]:
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
class Observations:
    """Marker displacements, final minus initial position, ordered from base to tip.

    Attributes:
        points: Initial positions, shape (m, 2), mm.
        displacements: Shape (m, 2), mm; meaningless at markers that are not visible.
        standard_deviations: Standard deviations of the displacements, shape (m, 2), mm.
        visible: Which markers were seen, shape (m,); none where no displacement is known.
        source: One sentence on the origin of the numbers, or on why there are none, shown with them.
        simulated: True if no camera was involved.
        marker_radius: Radius of the markers' discs, over which their displacements are means, mm.
        pressed: Registration of the pressed picture with that at rest.
        drawn: Registration of the picture at rest with the drawing.

    Raises:
        ShapeError: If the arrays do not fit together.
        UserError: If a standard deviation is negative or of an impossible size, or the radius is negative.
    """

    points: FloatArray
    displacements: FloatArray
    standard_deviations: FloatArray
    visible: BoolArray
    source: str
    simulated: bool
    marker_radius: float
    pressed: Registration = FIXED
    drawn: Registration = FIXED

    def __post_init__(self) -> None:
        count = len(np.atleast_1d(self.visible))
        for name, dtype, shape in (
            ("points", np.float64, (count, 2)),
            ("displacements", np.float64, (count, 2)),
            ("standard_deviations", np.float64, (count, 2)),
            ("visible", np.bool_, (count,)),
        ):
            frozen = frozen_array(getattr(self, name), dtype=dtype, shape=shape, name=name)
            object.__setattr__(self, name, frozen)
        deviations = self.standard_deviations
        if (deviations < 0).any():
            raise UserError("standard deviations must be zero or more (mm)")
        low, high = 1e-12, 1e6  # far below rounding, and beyond any marker
        if not ((deviations == 0) | (deviations >= low) & (deviations <= high)).all():
            raise UserError(
                f"standard deviations must be 0 or from {low:g} to {high:g} mm; set visible to 0 at a marker "
                "that was not measured"
            )
        if not 0 <= self.marker_radius < inf:
            raise UserError(f"the marker radius must be zero or more, got {self.marker_radius} (mm)")
        if count == 0:
            raise ShapeError("observations need at least one marker")

    @property
    def known(self) -> bool:
        """True if the displacement of a marker is known."""
        return bool(self.visible.any())

    @property
    def label(self) -> str:
        """`simulated`, `measured` or `unknown`, for captions."""
        return ("simulated" if self.simulated else "measured") if self.known else "unknown"

    @property
    def origin(self) -> str:
        """`source`, opened by the label."""
        said = self.source.lower().startswith(self.label)
        unknown = [
            f"the {picture}'s frame is known to {known}"
            for picture, known in (("pressed picture", self.pressed), ("picture at rest", self.drawn))
            if not known.fixed
        ]
        return "; ".join([self.source if said else f"{self.label}: {self.source}", *unknown])

"""Measured or simulated displacements of the markers."""

from dataclasses import dataclass
from math import inf, isfinite
from textwrap import shorten

import numpy as np
from numpy.typing import ArrayLike

from pinnray.geometry.picture_frame import FIXED, Registration
from pinnray.runtime.arrays import BoolArray, FloatArray, frozen_array
from pinnray.runtime.errors import ShapeError, UserError


@dataclass(frozen=True, eq=False, init=False)
class Observations:
    """Marker displacements, final minus initial position: `Observations(points, displacements)` is enough.

    Attributes:
        points: Initial positions, ordered from base to tip, shape (m, 2), mm.
        displacements: Shape (m, 2), mm; meaningless at markers that are not visible.
        standard_deviations: Of the displacements, shape (m, 2), mm, or one for all; 0 where unknown.
        visible: Which markers were seen, shape (m,), all if None; none where no displacement is known.
        source: One sentence on the origin of the numbers, or on why there are none, shown with them.
        simulated: True if no camera was involved; in plane strain, unless it is `solid`.
        solid: True if simulated in three dimensions, with the side faces that a camera sees.
        weighed: Force along the stroke that a scale showed when the finger was pressed so, and its standard
            deviation, N.
        marker_radius: Radius of the markers' discs, over which their displacements are means, mm; the default
            design's, `design.marker_radius` is that of another one.
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
    solid: bool
    weighed: tuple[float, float] | None
    marker_radius: float
    pressed: Registration
    drawn: Registration

    def __init__(
        self,
        points: ArrayLike,
        displacements: ArrayLike,
        standard_deviations: ArrayLike = 0.0,
        visible: ArrayLike | None = None,
        source: str = "measurements given as arrays",
        simulated: bool = False,
        solid: bool = False,
        weighed: tuple[float, float] | None = None,
        marker_radius: float = 0.8,
        pressed: Registration = FIXED,
        drawn: Registration = FIXED,
    ) -> None:
        (count, *_) = (*np.shape(np.asarray(points, dtype=object)), 1)
        if np.ndim(np.asarray(standard_deviations, dtype=object)) == 0:
            standard_deviations = np.full((count, 2), standard_deviations)
        for name, values, dtype, shape in (
            ("points", points, np.float64, (count, 2)),
            ("displacements", displacements, np.float64, (count, 2)),
            ("standard_deviations", standard_deviations, np.float64, (count, 2)),
            ("visible", np.ones(count) if visible is None else visible, np.bool_, (count,)),
        ):
            object.__setattr__(self, name, frozen_array(values, dtype=dtype, shape=shape, name=name))
        self.__dict__.update(source=source, simulated=simulated, solid=solid, weighed=weighed)
        self.__dict__.update(marker_radius=marker_radius, pressed=pressed, drawn=drawn)
        self._check()

    def __repr__(self) -> str:
        seen = f"{self.visible.sum()} of {len(self.visible)} markers"
        return f"Observations({seen}, {self.label}: {shorten(self.source, 80, placeholder=' ...')!r})"

    def _check(self) -> None:
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
        if self.weighed is not None and not (isfinite(self.weighed[0]) and 0 < self.weighed[1] < inf):
            force, deviation = self.weighed
            raise UserError(f"weighed: {force} ± {deviation} N; the deviation must be above zero")
        if not len(self.visible):
            raise ShapeError("observations need at least one marker")

    @property
    def plane(self) -> bool:
        """True if they are known to be of a finger without side faces."""
        return self.simulated and not self.solid

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

"""Frames of the observations' pictures as normal unknowns, for solvers that are linear in the displacements.

With standardised values z of the frames, the displacements y(z) of the finger are those that its pictures
show, turned, shifted and scaled back. About z₀

    y(z₀) - S z₀ = u - S z + e          S = ∂y/∂z, z normal a priori

so that the unknown frames are like further errors of the observations, common to all markers.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from geometry.arrays import FloatArray
from geometry.observations import Observations
from geometry.registration import Pictures, Registration, Similarity
from solvers.assimilation.estimation import LEVEL, Parameter, values_of

PARTS = {"turn": "deg", "shift_x": "mm", "shift_y": "mm", "scale": ""}
"""Values of a similarity, with their units."""
ROUNDS = 4
"""Linearisations about the frames that the last one found: from 5 degrees the last changes them by 1e-4."""


def picture_parameters(observations: Observations) -> list[Parameter]:
    """The unknown values of the pictures' similarities, with their priors; none where both are fixed."""
    return [*_of("pressed", observations.pressed), *_of("drawn", observations.drawn)]


def _of(picture: str, known: Registration) -> list[Parameter]:
    deviations = (known.turn, known.shift, known.shift, known.scale)
    return [
        Parameter(f"{picture}_{part}", unit, 0.0, deviation)
        for (part, unit), deviation in zip(PARTS.items(), deviations, strict=True)
        if deviation
    ]


class FramedData(NamedTuple):
    """Observations whose errors include those of the frames: observed = u + frames z + e."""

    observed: FloatArray  # Shape (m, 2), mm
    frames: FloatArray  # Shape (p, m, 2), mm; p = 0 where the frames are fixed


@dataclass(frozen=True, eq=False)
class FreePictures:
    """The p unknown values of the pictures' frames, and m markers that the pictures show."""

    points: FloatArray  # Shape (m, 2), mm
    shown: FloatArray  # Displacements in the pictures, shape (m, 2), mm
    parameters: Sequence[Parameter]
    centre: FloatArray  # Of turn and scale, shape (2,), mm

    @classmethod
    def of(cls, observations: Observations) -> "FreePictures":
        """Those of the markers that were seen."""
        seen, points = observations.visible, observations.points
        parameters = picture_parameters(observations)
        return cls(points[seen], observations.displacements[seen], parameters, points.mean(axis=0))

    def without(self, marker: int) -> "FreePictures":
        """Those of the other markers, about the same centre."""
        points, shown = (np.delete(values, marker, axis=0) for values in (self.points, self.shown))
        return replace(self, points=points, shown=shown)

    def at(self, z: FloatArray) -> Pictures:
        """The frames of standardised values, shape (p,)."""
        values, _ = values_of(self.parameters, z)
        named = dict(zip((each.name for each in self.parameters), values.tolist(), strict=True))
        return Pictures(
            *(
                Similarity(self.centre, np.array([named.get(f"{picture}_{part}", 0.0) for part in PARTS]))
                for picture in ("pressed", "drawn")
            )
        )

    def about(self, z: FloatArray) -> FramedData:
        """The observations, linear in the frames about standardised values, shape (p,)."""
        own = self.at(z).own(self.points, self.shown)
        slopes = np.zeros((len(z), *own.shape))
        for number, step in enumerate(1e-4 * np.eye(len(z))):
            ahead, behind = (self.at(z + sign * step).own(self.points, self.shown) for sign in (1, -1))
            slopes[number] = (ahead - behind) / 2e-4
        return FramedData(own - np.tensordot(z, slopes, axes=1), -slopes)

    def found(self, solve: "Callable[[FramedData], FloatArray]") -> FloatArray:
        """Standardised values, shape (p,), of which `solve` finds the mean for linearised observations."""
        z = np.zeros(len(self.parameters))
        for _ in range(ROUNDS if len(z) else 0):
            z = solve(self.about(z))
        return z

    def numbers(self, z: FloatArray, covariance: FloatArray) -> dict[str, float]:
        """What was found, for tables: each value with its standard deviation and 95 % interval."""
        values, slopes = values_of(self.parameters, z)
        deviations = np.abs(slopes) * np.sqrt(np.diagonal(covariance))
        half = float(norm.ppf((1 + LEVEL) / 2)) * deviations
        numbers: dict[str, float] = {}
        for parameter, value, deviation, width in zip(self.parameters, values, deviations, half, strict=True):
            numbers |= {parameter.name: float(value), f"{parameter.name}_deviation": float(deviation)}
            numbers |= {f"{parameter.name}_low": float(value - width)}
            numbers |= {f"{parameter.name}_high": float(value + width)}
        return numbers

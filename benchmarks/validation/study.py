"""Young's modulus from the markers of one case, and the prediction of the others."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from benchmarks.validation import comsol
from benchmarks.validation.half_beam import Deformation, HalfBeam
from benchmarks.validation.markers import LOADS, NOMINAL, length, marker_places, turned_offsets
from pinnray.runtime.arrays import FloatArray

KNOWN = "gravity"
"""Case whose markers Young's modulus is found from."""

BOUNDS = (0.1, 1.0)
"""Of Young's modulus, MPa."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """Predictions with the modulus from `KNOWN`, beside the measurements.

    Attributes:
        modulus: Young's modulus, MPa.
        deformations: Case by case.
        measured: Markers at rest case by case, shape (2 repeats, 3, 3), mm.
    """

    modulus: float
    deformations: dict[str, Deformation]
    measured: Mapping[str, FloatArray]

    def errors(self, case: str) -> FloatArray:
        """Predicted minus measured places, the latter in the mean of the repeats, shape (3, 3), mm."""
        return marker_places(self.deformations[case]) - self.measured[case].mean(axis=0)

    def error(self, case: str) -> float:
        """Root mean square over the markers of the distance between both, mm."""
        return length(self.errors(case))

    def moved(self, case: str) -> float:
        """Root mean square of the markers' measured distances from the straight beam, mm."""
        return length(self.measured[case].mean(axis=0) - NOMINAL[:3])

    def repeats(self, case: str) -> float:
        """Root mean square of the markers' distances between the two repeats, mm."""
        return length(np.diff(self.measured[case], axis=0)[0])

    def authors_error(self, case: str) -> float:
        """The same as `error` for COMSOL's places, with the markers' offsets turned as in this model."""
        theirs = comsol.PLACES[case] + turned_offsets(self.deformations[case])
        return length(theirs - self.measured[case].mean(axis=0))


def predict(beam: HalfBeam, measured: Mapping[str, FloatArray], *, tilt: float = 0.0) -> Outcome:
    """Find the modulus from `KNOWN`, and predict every case with it.

    Args:
        beam: The model.
        measured: Markers at rest case by case, shape (2 repeats, 3, 3), mm.
        tilt: Angle from -z to the vertical, radians.
    """
    modulus = young_modulus(beam, KNOWN, measured[KNOWN].mean(axis=0), tilt=tilt)
    return Outcome(modulus, all_cases(beam, modulus, tilt=tilt), measured)


def all_cases(beam: HalfBeam, modulus: float, *, tilt: float = 0.0) -> dict[str, Deformation]:
    """Deformation of every case, each from the one before; modulus in MPa, tilt in radians."""
    deformations: dict[str, Deformation] = {}
    last = None
    for case, load in LOADS.items():
        deformations[case] = last = beam.solve(modulus, load, tilt=tilt, start=last)
    return deformations


def young_modulus(beam: HalfBeam, case: str, places: FloatArray, *, tilt: float = 0.0) -> float:
    """Young's modulus, MPa, whose markers are nearest to places of shape (3, 3), mm, in the mean square."""
    last: list[Deformation] = []

    def residual(unknown: FloatArray) -> FloatArray:
        last[:] = [beam.solve(float(unknown[0]), LOADS[case], tilt=tilt, start=last[0] if last else None)]
        return (marker_places(last[0]) - places).ravel()

    found = least_squares(residual, [comsol.MODULUS], bounds=BOUNDS, diff_step=0.01, xtol=1e-3)
    return float(found.x[0])

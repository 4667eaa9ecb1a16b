"""The markers at rest against the drawing: how the finger lies in the film's frame, and at what scale.

A finger may lie beside its outline on the sheet of fiducials, the sheet may be printed at 99 %, and the
markers may be at another height above it than was said: a turn, a shift and a scale that all markers share.
They are fitted to the markers at rest, each with a prior, and taken off.
"""

from typing import NamedTuple

import numpy as np

from pinnray.geometry.picture_frame import FIXED, Homography, Registration, nearest_similarity
from pinnray.runtime.arrays import FloatArray

LAID = Registration(turn=1.0, shift=1.0, scale=0.01)
"""How a finger lies on its sheet before anything was measured, and how exactly that is printed."""
LEAST = 0.001
"""Least error of a marker's place, mm."""
DRAWN_BY_HAND = 0.05
"""Distance of the markers from the drawing, mm, from which they are no exact reference for it."""
FEWEST = 3
"""Number of markers that determines a similarity, with one to spare."""


class Alignment(NamedTuple):
    """What takes the markers at rest to the drawing; distances are root mean squares over the markers."""

    similarity: Homography
    known: Registration  # How well
    before: float  # Distance from the drawing in the film's frame, mm
    after: float  # Once aligned, mm

    @property
    def drawn(self) -> Registration:
        """How well the aligned frame is known in the drawing: exactly, where the markers are a good fit."""
        return FIXED if self.after < DRAWN_BY_HAND else self.known

    def numbers(self) -> dict[str, float]:
        """The alignment as numbers with units in their names."""
        names = ("turn_deg", "shift_x_mm", "shift_y_mm", "scale")
        found = dict(zip(names, self.similarity.values[:4].tolist(), strict=True))
        return found | {"offset_rms_before_mm": self.before}

    def __str__(self) -> str:
        turn, x, y, scale, *_ = self.similarity.values
        return (
            f"turned by {turn:z.2f} degrees, shifted by ({x:z.2f}, {y:z.2f}) mm and scaled by {scale:z.2%} "
            f"onto the drawing's markers, {self.after:.2g} mm (rms) off"
        )


def align(positions: FloatArray, expected: FloatArray) -> Alignment | None:
    """The alignment of markers at rest with the drawing; None if too few were seen.

    Args:
        positions: At rest in the film's frame, shape (m, 2), mm; nan where a marker was not seen.
        expected: In the drawing, shape (m, 2), mm.
    """
    seen = np.isfinite(positions).all(axis=1)
    places, drawn, count = positions[seen], expected[seen], int(seen.sum())
    extent = float(np.linalg.norm(places - places.mean(axis=0))) if count else 0.0
    if count < FEWEST or extent == 0:
        return None
    fitted = nearest_similarity(places, drawn)
    misfit = float(np.linalg.norm(fitted.moved(places) - drawn) / np.sqrt(2 * count - 4))
    error = max(misfit, LEAST)
    exact = Registration(np.degrees(error / extent), error / np.sqrt(count), error / extent)
    variances = exact.deviations**2
    shares = LAID.deviations**2 / np.maximum(LAID.deviations**2 + variances, np.finfo(float).tiny)
    similarity = Homography(fitted.centre, shares * fitted.values)
    turn, shift, _, scale, *_ = np.sqrt(shares * variances).tolist()
    known = Registration(turn, shift, scale)
    before, after = (
        float(np.sqrt(((moved - drawn) ** 2).sum(axis=1).mean()))
        for moved in (places, similarity.moved(places))
    )
    return Alignment(similarity, known, before, after)

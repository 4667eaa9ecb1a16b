"""Prior of the parameters of a disc's image, and the longest steps of its fit."""

import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.vision.discs.disc_image_model import (
    BLUR,
    EDGES,
    HALO,
    LIGHT,
    RADIUS,
    SHADE_X,
    SHADE_Y,
    SLANT,
    STRETCH,
    X,
    Y,
    irregular_columns,
)
from pinnray.vision.discs.least_squares import DiscPrior
from pinnray.vision.discs.pixel_windows import LIGHTEST

DEVIATIONS = {STRETCH: 0.05, SLANT: 0.05, BLUR: 5.0, SHADE_X: 0.05, SHADE_Y: 0.05}
"""Prior standard deviations, about zero but for the blur. They matter where little of the edge is seen."""
STEPS = {X: 1.0, Y: 1.0, STRETCH: 0.3, SLANT: 0.3, BLUR: 0.7, SHADE_X: 0.02, SHADE_Y: 0.02}
"""Longest steps of an iteration."""
EDGE_DEVIATIONS, EDGE_STEPS, MISSING = (0.5, 1.5, 100.0, 0.005), (0.3, 1.0, 1e3, 0.01), 1e-3
"""The same for edges beside the disc: rad, pixels, grey levels, 1/pixel; and the deviation of an absent
edge."""
OUTLINE_DEVIATION, OUTLINE_STEP = 0.05, 0.05
"""The same for the waves of an irregular outline, over the radius."""
HALO_DEVIATION, HALO_STEP = 1.0, 0.3
"""The same for the halo of a sharpened edge, over the contrast."""
CLIPPED = 100.0
"""Prior standard deviation of a clipped level, grey levels."""
CLIPPED_SHADE = 0.002
"""Prior standard deviation of the relative gradient of the light at a disc on a clipped ground, 1/pixel."""


def prior_and_limits(
    start: FloatArray, present: BoolArray, radii: FloatArray, tolerance: float
) -> tuple[DiscPrior, FloatArray]:
    """Prior of the parameters, and their longest steps; absent edges keep zero contrast.

    Args:
        start: Parameters at the start of the fit, shape (n, m).
        present: Edges that are there, shape (n, 2).
        radii: Known or guessed, shape (n,), pixels.
        tolerance: Relative standard deviation of the radii; infinite if they are guessed.
    """
    mean, deviations, limits = start.copy(), np.full(start.shape, 1e3), np.full(start.shape, 1e3)
    mean[:, [STRETCH, SLANT, SHADE_X, SHADE_Y]] = 0
    mean[:, RADIUS] = radii
    waves, first_edge = irregular_columns(start.shape[1])
    deviations[:, list(DEVIATIONS)] = list(DEVIATIONS.values())
    mean[:, waves], deviations[:, waves], limits[:, waves] = 0, OUTLINE_DEVIATION, OUTLINE_STEP
    if len(waves):
        deviations[:, HALO], limits[:, HALO] = HALO_DEVIATION, HALO_STEP
    clipped = start[:, LIGHT] >= LIGHTEST
    deviations[clipped, LIGHT] = CLIPPED
    for column in (SHADE_X, SHADE_Y):
        deviations[clipped, column] = CLIPPED_SHADE
    deviations[:, RADIUS] = np.minimum(tolerance * radii, 1e3)
    edges = np.where(present[:, :, None], EDGE_DEVIATIONS, MISSING)
    deviations[:, first_edge:] = edges.reshape(len(start), -1)
    limits[:, list(STEPS)] = list(STEPS.values())
    limits[:, RADIUS] = np.maximum(0.5, 0.2 * radii)
    limits[:, first_edge:] = EDGE_STEPS * EDGES
    return DiscPrior(mean, deviations**-2.0), limits

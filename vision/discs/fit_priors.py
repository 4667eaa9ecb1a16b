"""Prior of the parameters of a disc's image, and the longest steps of its fit."""

from typing import NamedTuple

import numpy as np
from scipy.special import softmax

from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray
from pinnray.vision.discs import disc_image_model as model
from pinnray.vision.discs.least_squares import DiscFit, DiscPrior
from pinnray.vision.discs.pixel_windows import LIGHTEST

ELLIPSE, SHADES = [model.STRETCH, model.SLANT], [model.SHADE_X, model.SHADE_Y]
DEVIATIONS = dict.fromkeys([*ELLIPSE, *SHADES], 0.05) | {model.BLUR: 5.0}
"""Prior standard deviations, about zero but for the blur. They matter where little of the edge is seen."""
STEPS = {model.X: 1.0, model.Y: 1.0, model.BLUR: 0.7, **dict.fromkeys(ELLIPSE, 0.3)}
STEPS |= dict.fromkeys(SHADES, 0.02)
"""Longest steps of an iteration."""
EDGE_DEVIATIONS, EDGE_STEPS, MISSING = (0.5, 1.5, 100.0, 0.005), (0.3, 1.0, 1e3, 0.01), 1e-3
"""The same for edges beside the disc: rad, pixels, grey levels, 1/pixel; and the deviation of an absent
edge."""
OUTLINE_DEVIATION, OUTLINE_STEP = 0.05, 0.05
"""The same for the waves of an irregular outline, over the radius."""
HALO_DEVIATION, HALO_STEP = 1.0, 0.3
"""The same for the halo of a sharpened edge, over the contrast."""
BRIGHTER = 3.0
"""Largest light at a disc over the median, and the median over the least; beyond, a level is no measure."""
CLIPPED = 100.0
"""Prior standard deviation of a clipped level, grey levels."""
CLIPPED_SHADE = 0.002
"""Prior standard deviation of the mean relative gradient of the light, 1/pixel."""
SCATTERS = np.geomspace(1e-5, 5e-3, 32)
"""Standard deviations of the gradient at discs from its mean that are weighed, 1/pixel."""


class Known(NamedTuple):
    """Knowledge of discs before their fit.

    Attributes:
        tolerance: Relative standard deviation of the radii; infinite if they are guessed.
        shade: Relative gradient of the light at discs on a clipped ground, shape (n, 2), 1/pixel.
        shade_deviation: Its standard deviations, shape (n, 2).
    """

    tolerance: float
    shade: FloatArray
    shade_deviation: FloatArray

    @classmethod
    def of(cls, count: int, tolerance: float) -> "Known":
        """Knowledge without any of the light."""
        return cls(tolerance, np.zeros((count, 2)), np.full((count, 2), CLIPPED_SHADE))

    def at(self, places: IntArray) -> "Known":
        """The same of some discs."""
        return self._replace(shade=self.shade[places], shade_deviation=self.shade_deviation[places])

    def lit(self, fit: DiscFit, trusted: BoolArray) -> "Known":
        """The same with the gradient of the light at a disc from the trusted others in the picture.

        The gradients, which are relative, times the light itself, by the levels within the discs, scatter
        normally about a mean; the variance of the scatter is its expectation over `SCATTERS`, which are
        equally probable before.

        Source: A. Gelman et al., Bayesian Data Analysis, third edition, 2013, section 5.4.
        """
        within = np.maximum(fit.parameters[:, model.LIGHT] - fit.parameters[:, model.CONTRAST], 1.0)
        light = np.clip(within / np.median(within), 1 / BRIGHTER, BRIGHTER)[:, None]
        precision = np.where(trusted[:, None], np.maximum(fit.shade_precision, 1e-3), 1e-3)
        fitted = light * fit.parameters[:, SHADES]
        variances = light**2 / precision
        weights = 1 / (SCATTERS[:, None, None] ** 2 + variances)
        total = weights.sum(axis=1) + CLIPPED_SHADE**-2.0
        mean = (weights * fitted).sum(axis=1) / total
        evidence = (np.log(weights).sum(axis=1) - (weights * (fitted - mean[:, None]) ** 2).sum(axis=1)) / 2
        evidence -= (np.log(total) + (mean / CLIPPED_SHADE) ** 2) / 2
        scatter = SCATTERS**2 @ softmax(evidence.sum(axis=1))
        weights = 1 / (scatter + variances)
        others = weights.sum(axis=0) - weights + CLIPPED_SHADE**-2.0
        shade = ((weights * fitted).sum(axis=0) - weights * fitted) / others
        deviation = np.sqrt(scatter + 1 / others)
        return self._replace(shade=shade / light, shade_deviation=deviation / light)


def prior_and_limits(
    start: FloatArray, present: BoolArray, radii: FloatArray, known: Known
) -> tuple[DiscPrior, FloatArray]:
    """Prior of the parameters, and their longest steps; absent edges keep zero contrast.

    Args:
        start: Parameters at the start of the fit, shape (n, m).
        present: Edges that are there, shape (n, 2).
        radii: Known or guessed, shape (n,), pixels.
        known: Of the discs.
    """
    mean, deviations, limits = start.copy(), np.full(start.shape, 1e3), np.full(start.shape, 1e3)
    mean[:, [*ELLIPSE, *SHADES]] = 0
    mean[:, model.RADIUS] = radii
    waves, first_edge = model.irregular_columns(start.shape[1])
    deviations[:, list(DEVIATIONS)] = list(DEVIATIONS.values())
    mean[:, waves], deviations[:, waves], limits[:, waves] = 0, OUTLINE_DEVIATION, OUTLINE_STEP
    if len(waves):
        deviations[:, model.HALO], limits[:, model.HALO] = HALO_DEVIATION, HALO_STEP
    clipped = start[:, model.LIGHT] >= LIGHTEST
    deviations[clipped, model.LIGHT] = CLIPPED
    shades = np.ix_(np.flatnonzero(clipped), np.array(SHADES))
    mean[shades], deviations[shades] = known.shade[clipped], known.shade_deviation[clipped]
    deviations[:, model.RADIUS] = np.minimum(known.tolerance * radii, 1e3)
    edges = np.where(present[:, :, None], EDGE_DEVIATIONS, MISSING)
    deviations[:, first_edge:] = edges.reshape(len(start), -1)
    limits[:, list(STEPS)] = list(STEPS.values())
    limits[:, model.RADIUS] = np.maximum(0.5, 0.2 * radii)
    limits[:, first_edge:] = EDGE_STEPS * model.EDGES
    return DiscPrior(mean, deviations**-2.0), limits

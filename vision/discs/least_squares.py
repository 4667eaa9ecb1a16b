"""Weighted Gauss-Newton fits of the image model to many discs at once.

Outlying pixels lose their weight, from three standard deviations of the noise on. At first the noise is
estimated from the residuals, so that nothing is rejected far from the solution; in the end it is at most the
noise between neighbouring pixels, so that a wrong fit cannot excuse itself.

Source: F. R. Hampel et al., Robust Statistics, Wiley 1986, section 2.6 (redescending weights); P. J. Huber,
Robust Statistics, Wiley 1981, chapter 7 (regression, scale by the median absolute residual).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray
from pinnray.vision.discs import disc_image_model as model
from pinnray.vision.discs.disc_image_model import Array
from pinnray.vision.discs.pixel_windows import (
    DARKEST,
    LIGHTEST,
    QUANTISATION,
    SCALE,
    PixelWindows,
    median_where,
)

FULL, NONE = 3.0, 6.0
"""Residuals over the noise up to which a pixel has full weight, and from which on it has none."""
COHERENT = 1.5
"""Largest mean of nine residuals, over the noise, that counts as noise."""
STEPS = 15
"""Largest number of iterations."""
LENIENT = 2
"""First iterations, in which the noise may be as large as the residuals suggest."""
TOLERANCE = 0.01
"""Last step of a centre, pixels."""
STEADY = 0.8
"""Variance of the noise over that of the iteration before, from which on a fit has settled."""
MODEL_ERROR = 0.04
"""Residual over contrast that is attributed to the model, not to occlusion."""
DOUBT = 20.0
"""Grey levels by which noise or a codec may move a clipped pixel from the limit."""
NEAR = 2.0
"""Pixels from the edge within which the noise matters most."""
SHARPEST = 0.3
"""Width of an edge without any blur, pixels: that of the pixels themselves."""
MOST_BENT = 0.08
"""Largest curvature of an edge beside a disc, over that of the disc: walls bend less."""
FAINT = 1e-5
"""Precision, relative and absolute, that is added for every parameter; it decides where few pixels do."""


class DiscPrior(NamedTuple):
    """Gaussian prior of the parameters: means and inverse variances, shapes (n, m)."""

    mean: FloatArray
    precision: FloatArray

    def at(self, places: IntArray) -> "DiscPrior":
        """The prior of some discs."""
        return DiscPrior(self.mean[places], self.precision[places])


@dataclass
class DiscFit:
    """State of a fit.

    Attributes:
        parameters: As in `pinnray.vision.discs.disc_image_model`, relative to the origins, shape (n, m).
        origins: Shape (n, 2), pixels.
        covariances: Of the centres, from the variance of the noise, shape (n, 2, 2), pixels².
        variance: Of the noise, shape (n,), grey levels².
        shade_precision: Of the relative gradient of the light by the pixels alone, shape (n, 2), pixels².
        seen: Share of the information on the radius that kept its weight, shape (n,).
        settled: Whether the last step was small, shape (n,).
    """

    parameters: FloatArray
    origins: IntArray
    covariances: FloatArray
    variance: FloatArray
    shade_precision: FloatArray
    seen: FloatArray
    settled: BoolArray

    @classmethod
    def start(cls, parameters: FloatArray, origins: IntArray) -> "DiscFit":
        """A fit before its first iteration."""
        count = len(parameters)
        covariances = np.tile(np.eye(2), (count, 1, 1))
        nothing = np.zeros(count)
        unknown, unsettled = np.zeros((count, 2)), np.zeros(count, dtype=bool)
        return cls(parameters, origins, covariances, np.ones(count), unknown, nothing, unsettled)

    def at(self, places: IntArray) -> "DiscFit":
        """The fit of some discs."""
        return DiscFit(*(values[places] for values in vars(self).values()))

    def put(self, places: IntArray, part: "DiscFit") -> None:
        """Replace the discs at some places."""
        for name, values in vars(part).items():
            getattr(self, name)[places] = values


def fit_disc_model(
    window: PixelWindows,
    start: FloatArray,
    prior: DiscPrior,
    limits: FloatArray,
    chosen: BoolArray,
    *,
    lenient: bool = False,
) -> tuple[DiscFit, Array]:
    """Fit each disc until its centre moves by less than `TOLERANCE`.

    Args:
        window: The pixels to fit.
        start: Parameters relative to the origins of the window, shape (n, m).
        prior: Of the parameters.
        limits: Longest step of every parameter, shape (n, m).
        chosen: Pixels that may be used, shape (n, p).
        lenient: Whether the noise may be as large as the residuals suggest to the end.

    Returns:
        The fit and the residuals of the pixels, shape (n, p).
    """
    count, width = start.shape
    result = DiscFit.start(start.copy(), window.origins)
    information = np.tile(np.eye(width), (count, 1, 1))
    all_residuals = np.empty_like(window.values)
    active = np.arange(count)
    bends = list(range(model.irregular_columns(width)[1] + model.EDGE - 1, width, model.EDGE))
    for number in range(STEPS):
        now, allowed, values = result.parameters[active], chosen[active], window.values[active]
        levels, derivatives = model.disc_image(now.astype(np.float32), window.x, window.y)
        beyond = beyond_limits(values, levels)
        counted, residuals = allowed & ~beyond, np.where(beyond, 0, values - levels)
        most = np.maximum(2 * window.noise[active], MODEL_ERROR * np.abs(now[:, model.CONTRAST]))
        if lenient or number < LENIENT:
            most = most + 1e3
        noise = np.minimum(SCALE * median_where(np.abs(residuals), counted), most)
        noise = np.maximum(noise, QUANTISATION**0.5)
        agreement = robust_weights(residuals / noise[:, None], allowed)
        weights = agreement * counted
        squares = (weights * residuals**2).sum(axis=1)
        variance = np.maximum(squares / np.maximum(weights.sum(axis=1) - width, 1), QUANTISATION)
        precision = prior.precision[active]
        normal = normal_matrices(derivatives, weights, variance, precision)
        gradient = (derivatives @ (weights * residuals)[:, :, None])[:, :, 0] / variance[:, None]
        gradient += precision * (prior.mean[active] - now)
        step = np.linalg.solve(normal, gradient[:, :, None])[:, :, 0]
        shortened = np.minimum(1, (limits[active] / np.maximum(np.abs(step), 1e-12)).min(axis=1))
        now = now + shortened[:, None] * step
        now[:, model.RADIUS] = np.maximum(now[:, model.RADIUS], 1.0)
        now[:, model.BLUR] = np.clip(now[:, model.BLUR], SHARPEST, now[:, model.RADIUS])
        most_bent = MOST_BENT / now[:, [model.RADIUS]]
        now[:, bends] = np.clip(now[:, bends], -most_bent, most_bent)
        steady = variance > STEADY * result.variance[active]
        result.parameters[active], information[active], result.variance[active] = now, normal, variance
        all_residuals[active] = residuals
        by_radius = derivatives[:, model.RADIUS] ** 2
        result.seen[active] = (by_radius * agreement).sum(axis=1) / np.maximum(by_radius.sum(axis=1), 1e-6)
        still = np.hypot(step[:, model.X], step[:, model.Y]) < TOLERANCE
        result.settled[active] = still & (number >= LENIENT) & steady
        active = active[~result.settled[active]]
        if not len(active):
            break
    covariances, shades = np.linalg.inv(information), [model.SHADE_X, model.SHADE_Y]
    result.covariances[:] = covariances[:, :2, :2]
    variances = np.maximum(covariances[:, shades, shades], 1e-12)
    result.shade_precision[:] = np.maximum(1 / variances - prior.precision[:, shades], 0)
    return result, all_residuals


def robust_weights(ratios: Array | FloatArray, allowed: BoolArray) -> Array:
    """Weights of residuals over their noise, shape (n, p); zero where a pixel is not allowed."""
    return np.asarray(np.clip((NONE - np.abs(ratios)) / (NONE - FULL), 0, 1) * allowed, dtype=np.float32)


def normal_matrices(
    derivatives: Array, weights: Array, variance: FloatArray, precision: FloatArray
) -> FloatArray:
    """Normal matrices of discs with the precision of the prior, shape (n, m, m).

    Args:
        derivatives: Of the pixels by the parameters, shape (n, m, p).
        weights: Of the pixels, shape (n, p).
        variance: Of the noise, shape (n,), grey levels².
        precision: Of the prior, shape (n, m).
    """
    normal = ((derivatives * weights[:, None]) @ derivatives.transpose(0, 2, 1)) / variance[:, None, None]
    diagonal = range(normal.shape[1])
    normal[:, diagonal, diagonal] *= 1 + FAINT
    normal[:, diagonal, diagonal] += precision + FAINT
    return np.asarray(normal, dtype=np.float64)


def beyond_limits(values: Array, levels: Array) -> BoolArray:
    """Pixels that the model clips and the image shows as clipped, so that they say no more, shape (n, p)."""
    light = (levels >= LIGHTEST) & (values >= LIGHTEST - DOUBT)
    return np.asarray(light | (levels <= DARKEST) & (values <= DARKEST + DOUBT))


def refined_fit(
    window: PixelWindows,
    priors: Sequence[DiscPrior],
    start: FloatArray,
    limits: FloatArray,
    chosen: BoolArray,
) -> tuple[DiscFit, Array]:
    """Fit by one prior after the other, each time to the pixels that agree with the fit before.

    A settled fit whose prior and pixels stay is not repeated. Arguments and result as of `fit_disc_model`.
    """
    result, residuals = fit_disc_model(window, start, priors[0], limits, chosen)
    used, moving, before = chosen.copy(), np.arange(len(start)), priors[0]
    for prior in priors[1:]:
        chosen = coherent_pixels(window, result, residuals)
        if prior is before:
            moving = moving[(chosen != used)[moving].any(axis=1) | ~result.settled[moving]]
        if not len(moving):
            break
        used, before = chosen, prior
        part, left = fit_disc_model(
            window.at(moving), result.parameters[moving], prior.at(moving), limits[moving], chosen[moving]
        )
        result.put(moving, part)
        residuals[moving] = left
    return result, residuals


def coherent_pixels(window: PixelWindows, fitted: DiscFit, residuals: Array) -> BoolArray:
    """Pixels that agree with the model together with all their neighbours, shape (n, p).

    Means of nine residuals show occlusions and neighbours that are hidden by the noise of single pixels.
    """
    tolerated = MODEL_ERROR / 2 * fitted.parameters[:, model.CONTRAST]
    most = COHERENT * np.maximum(fitted.variance, tolerated**2) ** 0.5
    wrong = np.abs(window.smoothed(residuals * window.within, 3)) > most[:, None]
    near = window.smoothed(wrong.astype(np.float32), 3) > 0
    return np.asarray(window.within & ~near)


def misfit(window: PixelWindows, parameters: FloatArray, variance: FloatArray) -> FloatArray:
    """Half the sum of the squared residuals over the variance of the noise, each at most `NONE`², shape (n,).

    Source: P. H. S. Torr, A. Zisserman, "MLESAC", Computer Vision and Image Understanding 78, 2000.
    """
    levels, _ = model.disc_image(parameters.astype(np.float32), window.x, window.y)
    squares = (window.values - np.clip(levels, 0, 255)) ** 2 / np.maximum(variance, QUANTISATION)[:, None]
    return np.asarray((np.minimum(squares, NONE**2) * window.within).sum(axis=1) / 2, dtype=np.float64)

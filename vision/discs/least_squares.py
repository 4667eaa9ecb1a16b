"""Weighted Gauss-Newton fits of the image model to many discs at once.

Outlying pixels lose their weight, from three standard deviations of the noise on. At first the noise is
estimated from the residuals, so that nothing is rejected far from the solution; in the end it is at most the
noise between neighbouring pixels, so that a wrong fit cannot excuse itself.

Source: F. R. Hampel et al., Robust Statistics, Wiley 1986, section 2.6 (redescending weights); P. J. Huber,
Robust Statistics, Wiley 1981, chapter 7 (regression, scale by the median absolute residual).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from geometry.arrays import BoolArray, FloatArray, IntArray
from vision.discs.disc_image_model import BLUR, CONTRAST, RADIUS, Array, X, Y, disc_image
from vision.discs.pixel_windows import QUANTISATION, SCALE, PixelWindows, median_where

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
MODEL_ERROR = 0.04
"""Residual over contrast that is attributed to the model, not to occlusion."""
DARKEST, LIGHTEST, DOUBT = 5, 250, 10
"""Grey levels beyond which pixels may be clipped, and by how much noise can hide it."""
NEIGHBOURS = 3
"""Side of the squares whose means show correlated noise, pixels."""
NEAR, PROFILE = 2.0, 0.5
"""Pixels from the edge within which the noise matters most, and width of the classes of that distance."""
SHARPEST = 0.3
"""Width of an edge without any blur, pixels: that of the pixels themselves."""
FAINT = 1e-5
"""Precision, relative and absolute, that is added for every parameter; it decides where few pixels do."""


class DiscPrior(NamedTuple):
    """Gaussian prior of the parameters: means and inverse variances, shapes (n, m)."""

    mean: FloatArray
    precision: FloatArray


@dataclass
class DiscFit:
    """State of a fit.

    Attributes:
        parameters: As in `vision.discs.disc_image_model`, relative to the origins, shape (n, m).
        origins: Shape (n, 2), pixels.
        covariances: Of the centres, from the variance of the noise, shape (n, 2, 2), pixels².
        variance: Of the noise, shape (n,), grey levels².
        seen: Share of the information on the radius that kept its weight, shape (n,).
        settled: Whether the last step was small, shape (n,).
    """

    parameters: FloatArray
    origins: IntArray
    covariances: FloatArray
    variance: FloatArray
    seen: FloatArray
    settled: BoolArray

    @classmethod
    def start(cls, parameters: FloatArray, origins: IntArray) -> "DiscFit":
        """A fit before its first iteration."""
        count = len(parameters)
        covariances = np.tile(np.eye(2), (count, 1, 1))
        return cls(parameters, origins, covariances, np.ones(count), np.zeros(count), np.zeros(count, bool))

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
    active, diagonal = np.arange(count), range(width)
    for number in range(STEPS):
        now, allowed, values = result.parameters[active], chosen[active], window.values[active]
        levels, derivatives = disc_image(now.astype(np.float32), window.x, window.y)
        clipped = np.minimum(levels, values + DOUBT) >= LIGHTEST
        clipped |= np.maximum(levels, values - DOUBT) <= DARKEST
        free = ~clipped  # a clipped pixel has no residual
        residuals = (values - levels) * free
        most = np.maximum(2 * window.noise[active], MODEL_ERROR * np.abs(now[:, CONTRAST]))
        if lenient or number < LENIENT:
            most = most + 1e3
        noise = np.minimum(SCALE * median_where(np.abs(residuals), allowed & free), most)
        noise = np.maximum(noise, QUANTISATION**0.5)
        ratio = np.abs(residuals) / noise[:, None].astype(np.float32)
        agreement = np.clip((NONE - ratio) / (NONE - FULL), 0, 1) * allowed
        weights = agreement * free
        weighted = derivatives * weights[:, None]
        squares = (weights * residuals**2).sum(axis=1)
        variance = np.maximum(squares / np.maximum(weights.sum(axis=1) - width, 1), QUANTISATION)
        precision = prior.precision[active]
        normal = (weighted @ derivatives.transpose(0, 2, 1)) / variance[:, None, None]
        normal[:, diagonal, diagonal] *= 1 + FAINT
        normal[:, diagonal, diagonal] += precision + FAINT
        gradient = (weighted @ residuals[:, :, None])[:, :, 0] / variance[:, None]
        gradient += precision * (prior.mean[active] - now)
        step = np.linalg.solve(normal, gradient[:, :, None])[:, :, 0]
        shortened = np.minimum(1, (limits[active] / np.maximum(np.abs(step), 1e-12)).min(axis=1))
        now = now + shortened[:, None] * step
        now[:, RADIUS] = np.maximum(now[:, RADIUS], 1.0)
        now[:, BLUR] = np.clip(now[:, BLUR], SHARPEST, now[:, RADIUS])
        result.parameters[active], information[active], result.variance[active] = now, normal, variance
        all_residuals[active] = residuals
        by_radius = derivatives[:, RADIUS] ** 2
        result.seen[active] = (by_radius * agreement).sum(axis=1) / np.maximum(by_radius.sum(axis=1), 1e-6)
        result.settled[active] = (np.hypot(step[:, X], step[:, Y]) < TOLERANCE) & (number >= LENIENT)
        active = active[~result.settled[active]]
        if not len(active):
            break
    result.covariances[:] = np.linalg.inv(information)[:, :2, :2]
    return result, all_residuals


def coherent_pixels(window: PixelWindows, fitted: DiscFit, residuals: Array) -> BoolArray:
    """Pixels that agree with the model together with all their neighbours, shape (n, p).

    Means of nine residuals show occlusions and neighbours that are hidden by the noise of single pixels.
    """
    tolerated = MODEL_ERROR / 2 * fitted.parameters[:, CONTRAST]
    most = COHERENT * np.maximum(fitted.variance, tolerated**2) ** 0.5
    wrong = np.abs(window.smoothed(residuals * window.within, 3)) > most[:, None]
    near = window.smoothed(wrong.astype(np.float32), 3) > 0
    return np.asarray(window.within & ~near)


def misfit(window: PixelWindows, parameters: FloatArray, variance: FloatArray) -> FloatArray:
    """Half the sum of the squared residuals over the variance of the noise, each at most `NONE`², shape (n,).

    Source: P. H. S. Torr, A. Zisserman, "MLESAC", Computer Vision and Image Understanding 78, 2000.
    """
    levels, _ = disc_image(parameters.astype(np.float32), window.x, window.y)
    squares = (window.values - np.clip(levels, 0, 255)) ** 2 / np.maximum(variance, QUANTISATION)[:, None]
    return np.asarray((np.minimum(squares, NONE**2) * window.within).sum(axis=1) / 2, dtype=np.float64)


def correlated_variance(
    window: PixelWindows, fitted: DiscFit, residuals: Array, chosen: BoolArray, outside: FloatArray
) -> FloatArray:
    """Variance of the noise near the edge that counts for the centres, over that of the fit, shape (n,).

    It is the variance of means over neighbours times their number, which is that of single pixels if the
    noise differs from pixel to pixel. Cameras and codecs that smooth, or quantise in blocks, leave correlated
    noise, and more of it near edges. The means of the residuals at every distance from the edge are left out:
    those of an edge that is sharpened, or has another profile, do not move a centre. Not a number where too
    few pixels count.

    Args:
        window: The pixels.
        fitted: The fit to them.
        residuals: Of the pixels, shape (n, p).
        chosen: Pixels that belong to the model, shape (n, p).
        outside: Distance of the pixels from the edge, shape (n, p), pixels.
    """
    chosen = chosen & (residuals != 0)  # clipped pixels
    inner = window.smoothed(chosen.astype(np.float32), NEIGHBOURS) > 1 - 1e-3
    inner &= np.abs(outside) < NEAR
    scaled = residuals / (fitted.variance[:, None] ** 0.5).astype(np.float32)
    scaled = np.clip(scaled, -NONE, NONE)
    bins, ends = np.floor(outside / PROFILE), int(NEAR / PROFILE)
    for number in range(-ends - 2, ends + 2):
        here = (bins == number) & chosen
        mean = (scaled * here).sum(axis=1, keepdims=True) / np.maximum(here.sum(axis=1, keepdims=True), 1)
        scaled = scaled - mean * here
    means = window.smoothed(scaled, NEIGHBOURS)
    count = inner.sum(axis=1)
    squares, single = (((part * inner) ** 2).sum(axis=1) for part in (means, scaled))
    known = np.maximum(NEIGHBOURS**2 * squares, single) / np.maximum(count - 2 * ends, 1)
    return np.where(count > 2 * ends, known, np.nan)

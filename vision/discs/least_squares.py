"""Weighted Gauss-Newton on the pictures of many discs at once.

Pixels that do not fit lose their weight, from three standard deviations of the noise on. At first the noise
is what the residuals say, so that nothing is rejected far from the solution; in the end it is at most what
neighbouring pixels say, so that a wrong fit cannot excuse itself.

Source: F. R. Hampel et al., Robust Statistics, Wiley 1986, section 2.6 (redescending weights); P. J. Huber,
Robust Statistics, Wiley 1981, chapter 7 (regression, scale by the median absolute residual).
"""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from geometry.arrays import BoolArray, FloatArray, IntArray
from vision.discs.disc_image_model import BLUR, CONTRAST, COUNT, RADIUS, Array, X, Y, picture
from vision.discs.pixel_windows import QUANTISATION, SCALE, PixelWindows, median_where

FULL, NONE = 3.0, 6.0
"""Residuals over the noise up to which a pixel has full weight, and from which on it has none."""

COHERENT = 1.5
"""Mean of nine residuals over the noise, above which they are no noise."""

STEPS = 15
"""At most."""

TOLERANCE = 0.01
"""Last step of a centre, pixels."""

MODEL_ERROR = 0.04
"""Residual over contrast that is put down to the model, not to hidden parts."""

DARKEST, LIGHTEST, DOUBT = 5, 250, 10
"""Grey levels beyond which pixels may be clipped, and by how much noise can hide it."""

NEIGHBOURS = 3
"""Side of the squares whose means show correlated noise, pixels."""

SHARPEST = 0.3
"""Width of an edge without any blur, pixels: that of the pixels themselves."""


class DiscPrior(NamedTuple):
    """What is known beforehand of the parameters: means and inverse variances, shapes (n, m)."""

    mean: FloatArray
    precision: FloatArray

    def at(self, places: IntArray) -> "DiscPrior":
        """Those of some discs."""
        return DiscPrior(self.mean[places], self.precision[places])


@dataclass
class DiscFit:
    """Where an adjustment stands.

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
    def empty(cls, count: int) -> Self:
        """Nothing adjusted yet."""
        return cls(
            parameters=np.zeros((count, COUNT)),
            origins=np.zeros((count, 2), dtype=np.int64),
            covariances=np.tile(np.eye(2), (count, 1, 1)),
            variance=np.ones(count),
            seen=np.zeros(count),
            settled=np.zeros(count, dtype=bool),
        )

    def at(self, places: IntArray) -> "DiscFit":
        """That of some discs."""
        return DiscFit(**{name: values[places] for name, values in vars(self).items()})

    def put(self, places: IntArray, part: "DiscFit") -> None:
        """Take the discs at some places from another fit."""
        for name, values in vars(part).items():
            getattr(self, name)[places] = values


FAINT = 1e-5
"""Precision, relative and absolute, that every parameter has beyond what is seen: where few pixels agree,
nothing else may determine it."""


class DiscAdjustment(NamedTuple):
    """What `adjust` gives: the fit, all parameters, shape (n, m), and the residuals, shape (n, p)."""

    fit: DiscFit
    parameters: FloatArray
    residuals: Array

    def at(self, places: IntArray) -> "DiscAdjustment":
        """That of some discs."""
        return DiscAdjustment(self.fit.at(places), self.parameters[places], self.residuals[places])


def adjust(
    window: PixelWindows,
    start: FloatArray,
    prior: DiscPrior,
    limits: FloatArray,
    chosen: BoolArray,
    lenient: int,
) -> DiscAdjustment:
    """Least squares from a start, each disc until its centre moves by less than `TOLERANCE`.

    Args:
        window: The pixels to fit.
        start: Parameters relative to the origins of the window, shape (n, m).
        prior: Of the parameters.
        limits: Longest step of every parameter, shape (n, m).
        chosen: Pixels that may be used, shape (n, p).
        lenient: First steps in which the noise may be as large as the residuals say.
    """
    count, width = start.shape
    fit = DiscFit.empty(count)
    parameters, information = start.copy(), np.tile(np.eye(width), (count, 1, 1))
    left_over = np.empty_like(window.values)
    active = np.arange(count)
    for number in range(STEPS):
        now, allowed, values = parameters[active], chosen[active], window.values[active]
        levels, derivatives = picture(now.astype(np.float32), window.x, window.y)
        clipped = np.minimum(levels, values + DOUBT) >= LIGHTEST
        clipped |= np.maximum(levels, values - DOUBT) <= DARKEST
        free = ~clipped  # of a clipped pixel nothing is known
        residuals = (values - levels) * free
        most = np.maximum(2 * window.noise[active], MODEL_ERROR * np.abs(now[:, CONTRAST]))
        if number < lenient:
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
        normal[:, range(width), range(width)] *= 1 + FAINT
        normal[:, range(width), range(width)] += precision + FAINT
        slope = (weighted @ residuals[:, :, None])[:, :, 0] / variance[:, None]
        slope += precision * (prior.mean[active] - now)
        step = np.linalg.solve(normal, slope[:, :, None])[:, :, 0]
        shortened = np.minimum(1, (limits[active] / np.maximum(np.abs(step), 1e-12)).min(axis=1))
        now = now + shortened[:, None] * step
        now[:, RADIUS] = np.maximum(now[:, RADIUS], 1.0)
        now[:, BLUR] = np.clip(now[:, BLUR], SHARPEST, now[:, RADIUS])
        parameters[active], information[active], fit.variance[active] = now, normal, variance
        left_over[active] = residuals
        by_radius = derivatives[:, RADIUS] ** 2
        fit.seen[active] = (by_radius * agreement).sum(axis=1) / np.maximum(by_radius.sum(axis=1), 1e-6)
        fit.settled[active] = (np.hypot(step[:, X], step[:, Y]) < TOLERANCE) & (number >= lenient)
        active = active[~fit.settled[active]]
        if not len(active):
            break
    fit.parameters[:], fit.origins[:] = parameters[:, :COUNT], window.origins
    fit.covariances[:] = np.linalg.inv(information)[:, :2, :2]
    return DiscAdjustment(fit, parameters, left_over)


def coherent(window: PixelWindows, adjusted: DiscAdjustment) -> BoolArray:
    """Where the picture is that of the model, and all pixels beside are as well, shape (n, p).

    Means of nine residuals show what is hidden or unexpected where a single one drowns in noise.
    """
    tolerated = MODEL_ERROR / 2 * adjusted.parameters[:, CONTRAST]
    most = COHERENT * np.maximum(adjusted.fit.variance, tolerated**2) ** 0.5
    wrong = np.abs(window.smoothed(adjusted.residuals * window.within, 3)) > most[:, None]
    near = window.smoothed(wrong.astype(np.float32), 3) > 0
    return np.asarray(window.within & ~near)


def correlation(window: PixelWindows, adjusted: DiscAdjustment, chosen: BoolArray, near: BoolArray) -> float:
    """Variance of means over neighbours times their number, over the variance of the noise; at least 1.

    It is 1 for noise that differs from pixel to pixel. Cameras and codecs that smooth, or quantise in blocks,
    leave noise that does not, and more of it near edges. The median over the discs: what only some of them
    show is no noise, but a picture that is not quite the model's.

    Args:
        window: The pixels.
        adjusted: What was fitted to them.
        chosen: Pixels that belong to the model, shape (n, p).
        near: Pixels to look at, shape (n, p).
    """
    inner = window.smoothed(chosen.astype(np.float32), NEIGHBOURS) > 1 - 1e-3
    inner &= near
    noise = adjusted.fit.variance[:, None] ** 0.5
    means = window.smoothed(adjusted.residuals / noise.astype(np.float32), NEIGHBOURS)
    count = inner.sum(axis=1)
    squares = NEIGHBOURS**2 * ((means * inner) ** 2).sum(axis=1)[count > 0] / count[count > 0]
    return max(1.0, float(np.median(squares))) if squares.size else 1.0

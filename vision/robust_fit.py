"""Weighted Gauss-Newton on the pictures of many discs at once.

Pixels that do not fit lose their weight, from three standard deviations of the noise on: hidden parts and
neighbours. The noise is taken from the residuals themselves, so that far from the solution nothing is
rejected.

Source: F. R. Hampel et al., Robust Statistics, Wiley 1986, section 2.6 (redescending weights); P. J. Huber,
Robust Statistics, Wiley 1981, chapter 7 (regression, scale by the median absolute residual).
"""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from geometry.arrays import BoolArray, FloatArray, IntArray
from vision.board import GreyImage
from vision.disc_model import BLUR, CONTRAST, COUNT, LIGHT, RADIUS, SHADE_X, SHADE_Y, Array, X, Y, picture

FULL, NONE = 3.0, 6.0
"""Residuals over the noise up to which a pixel has full weight, and from which on it has none."""

QUANTISATION = 1 / 12
"""Variance of rounding to grey levels: the least that the noise can be."""

SHARPEST = 0.3
"""Width of an edge without any blur, pixels: that of the pixels themselves."""


class Prior(NamedTuple):
    """What is known beforehand of the parameters: means and inverse variances, shapes (n, m)."""

    mean: FloatArray
    precision: FloatArray


@dataclass(frozen=True)
class Window:
    """The pixels around some discs.

    Attributes:
        origins: Pixels that the others are relative to, shape (n, 2).
        x, y: Of the pixels, shape (p,).
        values: Grey levels, shape (n, p).
        within: Whether the image has that pixel, shape (n, p).
    """

    origins: IntArray
    x: Array
    y: Array
    values: Array
    within: BoolArray

    @classmethod
    def of(cls, grey: GreyImage, centres: FloatArray, inner: float, outer: float) -> Self:
        """Pixels at distances from `inner` to `outer` from the centres, shape (n, 2)."""
        origins = np.rint(centres).astype(np.int64)
        reach = int(np.ceil(outer))
        y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
        away = np.hypot(x, y)
        ring = (away >= inner) & (away <= outer)
        columns, rows = origins[:, :1] + x[ring], origins[:, 1:] + y[ring]
        height, width = grey.shape
        return cls(
            origins=origins,
            x=x[ring].astype(np.float32),
            y=y[ring].astype(np.float32),
            values=grey[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)].astype(np.float32),
            within=(columns >= 0) & (columns < width) & (rows >= 0) & (rows < height),
        )


@dataclass
class Fit:
    """Where an adjustment stands.

    Attributes:
        parameters: As in `vision.disc_model`, relative to the origins, shape (n, m).
        origins: Shape (n, 2), pixels.
        information: Inverse covariances of the parameters, shape (n, m, m).
        variance: Of the noise, shape (n,), grey levels².
        seen: Share of the information on the radius that kept its weight, shape (n,).
        settled: Whether the last step was small, shape (n,).
    """

    parameters: FloatArray
    origins: IntArray
    information: FloatArray
    variance: FloatArray
    seen: FloatArray
    settled: BoolArray

    @classmethod
    def empty(cls, count: int) -> Self:
        """Nothing adjusted yet."""
        return cls(
            parameters=np.zeros((count, COUNT)),
            origins=np.zeros((count, 2), dtype=np.int64),
            information=np.tile(np.eye(COUNT), (count, 1, 1)),
            variance=np.ones(count),
            seen=np.zeros(count),
            settled=np.zeros(count, dtype=bool),
        )

    def put(self, places: IntArray, part: "Fit") -> None:
        """Take the discs at some places from another fit."""
        for name, values in vars(part).items():
            getattr(self, name)[places] = values

    def recentred(self, grey: GreyImage, inner: float, outer: float) -> tuple[Window, FloatArray]:
        """A window about what was found, and the parameters relative to its origins."""
        window = Window.of(grey, self.parameters[:, [X, Y]] + self.origins, inner, outer)
        parameters, moved = self.parameters.copy(), window.origins - self.origins
        parameters[:, [X, Y]] -= moved
        shade = 1 + (parameters[:, [SHADE_X, SHADE_Y]] * moved).sum(axis=1, keepdims=True)
        parameters[:, [LIGHT, CONTRAST]] *= shade
        parameters[:, [SHADE_X, SHADE_Y]] /= shade
        return window, parameters


def adjust(
    window: Window, start: FloatArray, prior: Prior, limits: FloatArray, *, steps: int, tolerance: float
) -> Fit:
    """Least squares from a start, each disc until its centre moves by less than `tolerance` pixels.

    Args:
        window: The pixels to fit.
        start: Parameters relative to the origins of the window, shape (n, m).
        prior: Of the parameters.
        limits: Longest step of every parameter, shape (n, m).
        steps: At most.
        tolerance: Pixels.
    """
    fit = Fit.empty(len(start))
    fit.parameters[:], fit.origins[:] = start, window.origins
    active = np.arange(len(start))
    for _ in range(steps):
        now, within = fit.parameters[active], window.within[active]
        levels, derivatives = picture(now.astype(np.float32), window.x, window.y)
        values = window.values[active]
        free = (levels < 255) & (levels > 0) | (values < 255) & (values > 0)  # a clipped pixel tells nothing
        residuals = (values - levels) * free
        agreement = _agreement(residuals, within & free) * within
        weights = agreement * free
        weighted = derivatives * weights[:, None]
        squares = np.maximum((weights * residuals**2).sum(axis=1), 0.0)
        variance = np.maximum(squares / np.maximum(weights.sum(axis=1) - COUNT, 1), QUANTISATION)
        precision = prior.precision[active]
        information = (weighted @ derivatives.transpose(0, 2, 1)) / variance[:, None, None]
        information[:, range(COUNT), range(COUNT)] += precision + 1e-12
        slope = (weighted @ residuals[:, :, None])[:, :, 0] / variance[:, None]
        slope += precision * (prior.mean[active] - now)
        step = np.linalg.solve(information, slope[:, :, None])[:, :, 0]
        shortened = np.minimum(1, (limits[active] / np.maximum(np.abs(step), 1e-12)).min(axis=1))
        fit.parameters[active] = now + shortened[:, None] * step
        fit.parameters[active, BLUR] = np.clip(
            fit.parameters[active, BLUR], SHARPEST, np.maximum(now[:, RADIUS], SHARPEST)
        )
        by_radius = derivatives[:, RADIUS] ** 2
        fit.seen[active] = (by_radius * agreement).sum(axis=1) / np.maximum(by_radius.sum(axis=1), 1e-6)
        fit.information[active], fit.variance[active] = information, variance
        fit.settled[active] = np.hypot(step[:, X], step[:, Y]) < tolerance
        active = active[~fit.settled[active]]
        if not len(active):
            break
    return fit


def median_where(values: Array, chosen: BoolArray) -> FloatArray:
    """The median of the chosen values of every row, shape (n,); zero where there is none."""
    ordered = np.sort(np.where(chosen, values, np.inf), axis=1)
    middle = np.take_along_axis(ordered, chosen.sum(axis=1, keepdims=True) // 2, axis=1)[:, 0]
    return np.where(chosen.any(axis=1), middle, 0.0)


def _agreement(residuals: Array, chosen: BoolArray) -> Array:
    """Weights, with the noise from the chosen pixels."""
    size = np.abs(residuals)
    noise = np.maximum(1.4826 * median_where(size, chosen), QUANTISATION**0.5)
    ratio = size / noise[:, None].astype(np.float32)
    return np.clip((NONE - ratio) / (NONE - FULL), 0, 1)

"""Noise that neighbouring pixels share, as it counts for the centre of a disc.

Cameras and codecs that smooth, or quantise in blocks, leave correlated noise, and more of it near edges;
specks of a print are noise of that kind. Its variance is that of means over neighbours times their number,
which is that of single pixels if the noise differs from pixel to pixel.
"""

from typing import NamedTuple

import numpy as np

from geometry.arrays import BoolArray, FloatArray
from vision.discs.disc_image_model import EDGE, EDGES, Array, disc_image, irregular_columns
from vision.discs.fit_priors import Known, prior_and_limits
from vision.discs.least_squares import FAINT, NEAR, NONE, DiscFit
from vision.discs.pixel_windows import PixelWindows

NEIGHBOURS = 3
"""Side of the squares whose means show correlated noise, pixels."""
PROFILE = 0.5
"""Width of the classes of the distance from the edge, pixels."""
ENDS = int(NEAR / PROFILE)
POOLED = 8.0
"""Weight of the discs' usual variance beside a disc's own, in independent squares."""


class Absorbed(NamedTuple):
    """Shares of the noise near the edge that the parameters of a fit take up.

    Attributes:
        means: Of the variance of means over neighbours.
        single: Of that of single pixels.
    """

    means: float
    single: float


class CorrelatedNoise(NamedTuple):
    """Variance of the noise near the edge that counts for the centres, over that of the fit.

    Attributes:
        variance: By means over neighbours and by single pixels, shape (n, 2); not a number where too few
            pixels count.
        squares: Independent squares of neighbours that show it, shape (n,).
    """

    variance: FloatArray
    squares: FloatArray

    @property
    def of_each(self) -> FloatArray:
        """The larger of the two of each disc, shape (n,)."""
        return np.asarray(self.variance.max(axis=1))

    @property
    def usual(self) -> FloatArray:
        """The medians over the discs, which leave out errors of the model that only some have, shape (2,)."""
        known = self.variance[np.isfinite(self.variance).all(axis=1)]
        return np.median(known, axis=0) if len(known) else np.ones(2)

    def pooled(self, usual: FloatArray) -> FloatArray:
        """That of each disc, drawn to the usual one as far as few squares show it, shape (n,)."""
        own = np.where(np.isfinite(self.variance), self.variance, usual)
        squares = self.squares[:, None]
        return np.asarray(((squares * own + POOLED * usual) / (squares + POOLED)).max(axis=1))


def absorbed_noise(
    window: PixelWindows, fitted: DiscFit, chosen: BoolArray, radii: FloatArray, known: Known
) -> Absorbed:
    """Shares of the noise that a fit takes up, about the same for all discs of one size.

    They follow from the projection on the derivatives of the model, for the disc of which most is seen.

    Args:
        window: The pixels.
        fitted: The fit to them.
        chosen: Pixels that belong to the model, shape (n, p).
        radii: Known or guessed, shape (n,), pixels.
        known: Of the discs.
    """
    one = (chosen & (np.abs(window.outside(fitted.parameters)) < NEAR)).sum(axis=1).argmax()[None]
    some, parameters, used = window.at(one), fitted.parameters[one], chosen[one]
    first = irregular_columns(parameters.shape[1])[1]
    present = parameters[:, first:].reshape(-1, EDGES, EDGE).any(axis=2)
    prior, _ = prior_and_limits(parameters, present, radii[one], known.at(one))
    _, derivatives = disc_image(parameters.astype(np.float32), some.x, some.y)
    columns = derivatives[0] * used
    normal = (columns @ columns.T).astype(np.float64)
    diagonal = range(len(normal))
    normal[diagonal, diagonal] *= 1 + FAINT
    normal[diagonal, diagonal] += fitted.variance[one] * (prior.precision[0] + FAINT)
    inverse = np.linalg.inv(normal)
    inner = _inner(some, used, some.outside(parameters))[0]
    single, means = columns[:, inner], some.smoothed(columns, NEIGHBOURS)[:, inner]
    share = [float((part * (inverse @ part)).sum() / max(inner.sum(), 1)) for part in (means, single)]
    return Absorbed(NEIGHBOURS**2 * share[0], share[1])


def correlated_noise(
    window: PixelWindows,
    fitted: DiscFit,
    residuals: Array,
    chosen: BoolArray,
    outside: FloatArray,
    absorbed: Absorbed,
) -> CorrelatedNoise:
    """The noise near the edges of discs.

    The means of the residuals at every distance from the edge are left out: those of an edge that is
    sharpened, or has another profile, do not move a centre.

    Args:
        window: The pixels.
        fitted: The fit to them.
        residuals: Of the pixels, shape (n, p).
        chosen: Pixels that belong to the model, shape (n, p).
        outside: Distance of the pixels from the edge, shape (n, p), pixels.
        absorbed: Shares of the noise that the fit took up.
    """
    chosen = chosen & (residuals != 0)  # clipped pixels
    inner = _inner(window, chosen, outside)
    scaled = residuals / (fitted.variance[:, None] ** 0.5).astype(np.float32)
    scaled = np.clip(scaled, -NONE, NONE)
    bins = np.floor(outside / PROFILE)
    for number in range(-ENDS - 2, ENDS + 2):
        here = (bins == number) & chosen
        mean = (scaled * here).sum(axis=1, keepdims=True) / np.maximum(here.sum(axis=1, keepdims=True), 1)
        scaled = scaled - mean * here
    means = window.smoothed(scaled, NEIGHBOURS)
    count = inner.sum(axis=1)
    sums = [((part * inner) ** 2).sum(axis=1) for part in (NEIGHBOURS * means, scaled)]
    left = np.subtract(1, absorbed) * np.maximum(count - 2 * ENDS, 1)[:, None]
    variance = np.where((count > 2 * ENDS)[:, None], np.stack(sums, axis=1) / left, np.nan)
    return CorrelatedNoise(variance, left[:, 0] / NEIGHBOURS**2)


def _inner(window: PixelWindows, chosen: BoolArray, outside: FloatArray) -> BoolArray:
    """Pixels near the edge whose neighbours all belong to the model, shape (n, p)."""
    whole = window.smoothed(chosen.astype(np.float32), NEIGHBOURS) > 1 - 1e-3
    return np.asarray(whole & (np.abs(outside) < NEAR))

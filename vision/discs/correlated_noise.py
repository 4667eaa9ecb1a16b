"""Noise that neighbouring pixels share, as it counts for the centre of a disc.

Cameras and codecs that smooth, or quantise in blocks, leave correlated noise, and more of it near edges;
specks of a print are noise of that kind. The shift of a centre is the sum over the pixels of influence times
residual; the variance of its sums over neighbours is that of single pixels if the noise differs from pixel to
pixel. What the disc's contrast, edge or outline would explain does not move a centre and is left out.

Source: W. K. Newey, K. D. West, "A simple, positive semi-definite, heteroskedasticity and autocorrelation
consistent covariance matrix", Econometrica 55, 1987.
"""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.vision.discs.disc_image_model import (
    COUNT,
    EDGE,
    EDGES,
    GLARE,
    Array,
    X,
    Y,
    disc_image,
    irregular_columns,
)
from pinnray.vision.discs.edge_profile import edge_profile
from pinnray.vision.discs.fit_priors import Known, prior_and_limits
from pinnray.vision.discs.least_squares import FAINT, FULL, NONE, DiscFit, behind_clipping
from pinnray.vision.discs.pixel_windows import DARKEST, LIGHTEST, PixelWindows

NEIGHBOURS = 3
"""Side of the squares whose sums show correlated noise, pixels."""
CLIPPED = 0.1
"""Share of clipped pixels from which on an outline is not told from noise."""
FAR = 4.0
"""Largest variance over the usual one that counts in full for the scatter of the discs."""
SIGNIFICANT = 30.0
"""Squares, over the variance of the noise, that the waves and the halo of an irregular outline must explain
before they count as no noise; of white noise they explain less in 99 of 100 discs."""
WHITE = 1.0
"""Usual variance of what they leave, over that of the fit, below which they have explained all: specks, which
outlines explain in part, are noise."""
LEAST = 1e-3
"""Least usual variance, and least number of squares: pictures without any noise have none."""
POOLED = 8.0
"""Weight of a scatter of the discs of a quarter, beside that seen, in discs."""


class CorrelatedNoise(NamedTuple):
    """Variance of the noise that counts for the centres, over that of the fit.

    Attributes:
        variance: By sums over neighbours and by single pixels, shape (n, 2); not a number where no pixel
            counts.
        squares: Independent squares of neighbours that show it, shape (n,).
        misfit: The larger of the two with what an irregular outline or a sharpened edge would explain, shape
            (n,).
    """

    variance: FloatArray
    squares: FloatArray
    misfit: FloatArray

    @property
    def pooled(self) -> FloatArray:
        """That of each disc, drawn to the usual one as far as the discs are alike and few squares show it.

        The usual one is the median over the discs. How many squares it is worth follows from the scatter of
        the discs about it, beyond that of variances from so few squares.

        Returns:
            The larger of the two, shape (n,).

        Source: G. K. Smyth, "Linear models and empirical Bayes methods for assessing differential
        expression", Statistical Applications in Genetics and Molecular Biology 3, 2004, section 6.
        """
        known = np.isfinite(self.variance).all(axis=1)
        if not known.any():
            return np.ones(len(self.variance))
        usual = np.maximum(np.median(self.variance[known], axis=0), LEAST)
        own = np.where(known[:, None], self.variance, usual)
        squares = np.maximum(self.squares, LEAST)[:, None]
        away = ((np.clip(own / usual, 0, FAR) - 1) ** 2 - 2 / squares)[known].sum(axis=0)
        scatter = np.maximum((POOLED / 4 + away) / (POOLED + known.sum()), 1e-3)
        worth = 2 / scatter
        # What a robust fit leaves out shifts a disc as well, so none has less than is usual.
        drawn = (squares * np.maximum(own, usual) + worth * usual) / (squares + worth)
        return np.asarray(drawn.max(axis=1))


@dataclass(frozen=True)
class _Linearised:
    """Discs near their fits, with the columns of irregular outlines.

    Attributes:
        derivatives: Shape (n, m, p).
        weights: Of the pixels in the fit, shape (n, p).
        inverse: Of the normal matrix of all columns, shape (n, m, m), grey levels².
        fitted: The same of the columns that the fit had, shape (n, k, k).
        influence: Of the pixels on the centres, shape (n, 2, p), pixels over grey levels.
    """

    derivatives: Array
    weights: Array
    inverse: FloatArray
    fitted: FloatArray
    influence: Array

    @classmethod
    def of(
        cls,
        window: PixelWindows,
        parameters: FloatArray,
        variance: FloatArray,
        agreement: Array,
        own: list[int],
        radii: FloatArray,
        known: Known,
    ) -> Self:
        """Linearise; `own` are the columns that the fit had, `agreement` the pixels' robust weights."""
        levels, derivatives = disc_image(parameters.astype(np.float32), window.x, window.y)
        weights = (agreement * behind_clipping(window.values, levels, variance)[1]).astype(np.float32)
        first = irregular_columns(parameters.shape[1])[1]
        present = parameters[:, first:].reshape(-1, EDGES, EDGE).any(axis=2)
        prior, _ = prior_and_limits(parameters, present, radii, known)
        normal = ((derivatives * weights[:, None]) @ derivatives.transpose(0, 2, 1)).astype(np.float64)
        diagonal = range(normal.shape[1])
        normal[:, diagonal, diagonal] *= 1 + FAINT
        normal[:, diagonal, diagonal] += variance[:, None] * (prior.precision + FAINT)
        inverse = np.linalg.inv(normal)
        fitted = np.linalg.inv(normal[:, own][:, :, own]) if len(own) < len(diagonal) else inverse
        influence = fitted[:, [X, Y]].astype(np.float32) @ derivatives[:, own]
        return cls(derivatives, weights, inverse, fitted, influence)

    def orthogonal(self, residuals: Array) -> Array:
        """Weighted residuals, shape (n, p), without the part that any of the columns explains."""
        steps = self.inverse @ (self.derivatives @ residuals[:, :, None])
        explained = (steps.transpose(0, 2, 1) @ self.derivatives)[:, 0]
        return np.asarray(residuals - self.weights * explained, dtype=np.float32)

    def absorbed(self, window: PixelWindows, inverse: FloatArray, columns: list[int]) -> FloatArray:
        """Shares of white noise that a fit takes up: of sums and of single pixels, shape (2,).

        They follow from the projection on the derivatives, for the disc of which most is seen; those of one
        size have about the same.

        Args:
            window: The pixels.
            inverse: Of the fit's normal matrix, shape (n, k, k), grey levels².
            columns: Those of the fit.
        """
        one = self.weights.sum(axis=1).argmax()
        derivatives, weights, shares = self.derivatives[one][columns], self.weights[one], np.zeros(2)
        for influence in self.influence[one]:
            parts = derivatives * (influence * weights)
            sums = NEIGHBOURS * window.smoothed(parts, NEIGHBOURS)
            shares[0] += (sums * (inverse[one] @ sums)).sum()
            shares[1] += (parts * (inverse[one] @ derivatives) * influence * weights).sum()
        return shares / max(float((self.influence[one] ** 2 * weights).sum()), 1e-30)

    def variance(self, window: PixelWindows, residuals: Array) -> FloatArray:
        """Variance of the centres' shifts over that of white noise, by sums and by single pixels, (n, 2)."""
        scores = self.influence * residuals[:, None]
        sums = NEIGHBOURS * window.smoothed(scores.reshape(-1, scores.shape[2]), NEIGHBOURS)
        seen = np.stack([(part**2).reshape(len(scores), -1).sum(axis=1) for part in (sums, scores)], axis=1)
        expected = (self.influence**2 * self.weights[:, None]).sum(axis=(1, 2))
        return np.divide(
            seen, expected[:, None], out=np.full(seen.shape, np.nan), where=expected[:, None] > 0
        ).astype(np.float64)

    @property
    def squares(self) -> FloatArray:
        """Independent squares of neighbours that decide a centre, shape (n,)."""
        length = (self.influence**2).sum(axis=1) * self.weights
        pixels = length.sum(axis=1) ** 2 / np.maximum((length**2).sum(axis=1), np.finfo(np.float32).tiny)
        return np.asarray(2 * pixels / NEIGHBOURS**2, dtype=np.float64)  # of either coordinate


def correlated_noise(
    window: PixelWindows,
    fitted: DiscFit,
    residuals: Array,
    chosen: BoolArray,
    radii: FloatArray,
    known: Known,
) -> CorrelatedNoise:
    """The noise near the edges of discs.

    Args:
        window: The pixels.
        fitted: The fit to them.
        residuals: Of the pixels, shape (n, p).
        chosen: Pixels that belong to the model, shape (n, p).
        radii: Known or guessed, shape (n,), pixels.
        known: Of the discs.
    """
    parameters, width = fitted.parameters, fitted.parameters.shape[1]
    if not len(parameters):
        return CorrelatedNoise(np.empty((0, 2)), np.empty(0), np.empty(0))
    own = list(range(width))
    if plain := not len(irregular_columns(width)[0]):
        parameters = np.insert(parameters, [COUNT] * (GLARE.start - COUNT), 0.0, axis=1)
        own = [*range(COUNT), *range(GLARE.start, parameters.shape[1])]
    noise = np.sqrt(fitted.variance)[:, None].astype(np.float32)
    chosen = chosen & (residuals != 0)  # clipped pixels
    agreement = (np.clip((NONE - np.abs(residuals) / noise) / (NONE - FULL), 0, 1) * chosen).astype(
        np.float32
    )
    near = _Linearised.of(window, parameters, fitted.variance, agreement, own, radii, known)
    left = agreement * residuals / noise
    left = np.clip(left - edge_profile(window, parameters, left, noise, chosen), -NONE, NONE)
    left = left.astype(np.float32)
    absorbed = near.absorbed(window, near.fitted, own)
    variance = near.variance(window, left) / (1 - absorbed)
    misfit = variance.max(axis=1)
    clipped = (window.values >= LIGHTEST) | (window.values <= DARKEST)
    whole = clipped.mean(axis=1) < CLIPPED
    if plain and whole.any():
        absorbed = near.absorbed(window, near.inverse, list(range(parameters.shape[1])))
        rest = near.orthogonal(left)
        outlined = whole & (((left - rest) * left).sum(axis=1) > SIGNIFICANT)
        of_rest = near.variance(window, rest) / (1 - absorbed)
        if outlined.any() and np.median(of_rest[outlined].max(axis=1)) < WHITE:
            variance = np.where(outlined[:, None], of_rest, variance)
    return CorrelatedNoise(variance, near.squares * (1 - absorbed[0]), misfit)

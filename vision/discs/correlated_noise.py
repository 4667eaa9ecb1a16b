"""Noise that neighbouring pixels share, as it counts for the centre of a disc.

Cameras and codecs that smooth, or quantise in blocks, leave correlated noise, and more of it near edges;
specks of a print are noise of that kind. The shift of a centre is the sum over the pixels of influence times
residual; the variance of its sums over neighbours is that of single pixels if the noise differs from pixel to
pixel.

Source: W. K. Newey, K. D. West, "A simple, positive semi-definite, heteroskedasticity and autocorrelation
consistent covariance matrix", Econometrica 55, 1987.
"""

import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.vision.discs.disc_image_model import EDGE, EDGES, Array, X, Y, disc_image, irregular_columns
from pinnray.vision.discs.fit_priors import Known, prior_and_limits
from pinnray.vision.discs.least_squares import DiscFit, beyond_limits, normal_matrices, robust_weights
from pinnray.vision.discs.pixel_windows import PixelWindows

NEIGHBOURS = 3
"""Side of the squares whose sums show correlated noise, pixels."""


def correlated_noise(
    window: PixelWindows,
    fitted: DiscFit,
    residuals: Array,
    chosen: BoolArray,
    radii: FloatArray,
    known: Known,
) -> FloatArray:
    """Variance of the noise that counts for the centres, over that of the fit.

    Args:
        window: The pixels.
        fitted: The fit to them.
        residuals: Of the pixels, shape (n, p).
        chosen: Pixels that belong to the model, shape (n, p).
        radii: Known or guessed, shape (n,), pixels.
        known: Of the discs.

    Returns:
        By sums over neighbours and by single pixels, shape (n, 2); not a number where no pixel counts.
    """
    parameters, count = fitted.parameters, len(fitted.parameters)
    if not count:
        return np.empty((0, 2))
    noise = np.sqrt(fitted.variance)[:, None].astype(np.float32)
    levels, derivatives = disc_image(parameters.astype(np.float32), window.x, window.y)
    weights = robust_weights(residuals / noise, chosen & ~beyond_limits(window.values, levels))
    present = parameters[:, irregular_columns(parameters.shape[1])[1] :].reshape(-1, EDGES, EDGE).any(axis=2)
    prior, _ = prior_and_limits(parameters, present, radii, known)
    inverse = np.linalg.inv(normal_matrices(derivatives, weights, fitted.variance, prior.precision))
    influence = (inverse[:, [X, Y]] / fitted.variance[:, None, None]).astype(np.float32) @ derivatives
    scores = influence * (weights * residuals / noise)[:, None]
    sums = NEIGHBOURS * window.smoothed(scores.reshape(2 * count, -1), NEIGHBOURS)
    seen = np.stack([(part**2).reshape(count, -1).sum(axis=1) for part in (sums, scores)], axis=1)
    expected = (influence**2 * weights[:, None]).sum(axis=(1, 2))[:, None]
    variance = np.divide(seen, expected, out=np.full(seen.shape, np.nan), where=expected > 0)
    # Discs of one size take up about the same share of the noise: as that of which most is seen.
    one = weights.sum(axis=1).argmax()
    scale = max(float(fitted.variance[one] * expected[one, 0]), 1e-30)
    absorbed = _absorbed(window, derivatives[one], weights[one], influence[one], inverse[one]) / scale
    return np.asarray(variance / (1 - absorbed), dtype=np.float64)


def _absorbed(
    window: PixelWindows, derivatives: Array, weights: Array, influence: Array, inverse: FloatArray
) -> FloatArray:
    """White noise that the fit of a disc takes up, of sums and of single pixels, shape (2,).

    It follows from the projection on the derivatives, shape (m, p).
    """
    shares = np.zeros(2)
    for own in influence:
        parts = derivatives * (own * weights)
        sums = NEIGHBOURS * window.smoothed(parts, NEIGHBOURS)
        shares[0] += (sums * (inverse @ sums)).sum()
        shares[1] += (parts * (inverse @ derivatives) * own * weights).sum()
    return shares

"""Sub-pixel centres of disc markers, with covariances: a parametric fit to the grey levels around the edge.

The grey levels follow `vision.discs.disc_image_model`; `vision.discs.least_squares` fits all discs at
once. Occlusions and neighbours get little weight, and the covariance follows from the noise of the residuals.
Units: pixels, grey levels.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pinnray.runtime.arrays import BoolArray, FloatArray, frozen_array
from pinnray.vision.discs import disc_image_model as model
from pinnray.vision.discs.fit_priors import Known
from pinnray.vision.discs.fit_stages import fit_discs_of_one_size
from pinnray.vision.discs.least_squares import DiscFit
from pinnray.vision.discs.pixel_windows import LIGHTEST
from pinnray.vision.frames.frame import GreyImage

KNOWN_RADIUS = 0.01
"""Relative standard deviation of a known radius: markers turn and change their distance a little."""
LEAST_SEEN, LEAST_SEEN_UNKNOWN = 0.25, 0.7
"""Share of the edge below which a disc counts as not found, with a known radius and without."""
LARGEST_DEVIATION = 0.5
"""Standard deviation of the centre, pixels, above which a disc counts as not found."""
LARGEST_RESIDUAL = 0.25
"""Root mean square residual, over the contrast, above which a disc counts as not found."""
LARGEST_CONTRAST = 400.0
"""Contrast, grey levels, above which a disc counts as not found: of light that is clipped."""
RADII = (0.6, 1.6)
"""Accepted ratios of fitted to guessed radius."""


@dataclass(frozen=True)
class FittedDiscs:
    """Fitted discs; where `found` is false, all but `seen` is NaN.

    Attributes:
        centres: x, y, shape (n, 2), pixels.
        covariances: Of the centres, shape (n, 2, 2), pixels², with correlated noise, such as a codec's,
            at least its median over the discs of about one size.
        radii: Square root of the product of the semi-axes, shape (n,), pixels.
        contrast: Level around the disc less level within, shape (n,), grey levels; negative for light discs.
        seen: Share of the edge that supports the fit, shape (n,).
        found: Shape (n,).
    """

    centres: FloatArray
    covariances: FloatArray
    radii: FloatArray
    contrast: FloatArray
    seen: FloatArray
    found: BoolArray


def fit_discs(grey: GreyImage, guesses: ArrayLike, *, radii: ArrayLike | None = None) -> FittedDiscs:
    """Fit discs to an image, each from a guess that may be off by several pixels.

    Args:
        grey: Shape (height, width).
        guesses: x, y and radius of every disc, shape (n, 3), pixels.
        radii: Known radii, one for all or shape (n,), pixels. They make partly hidden discs measurable, whose
            size and place are otherwise coupled; without them such discs are found only if most is seen.

    Returns:
        As many discs as guesses, in their order. A disc is found if the fit converged near the guess and
        agrees with enough of the edge.

    Raises:
        ShapeError: If the guesses or radii have another shape.
    """
    guesses = frozen_array(guesses, dtype=np.float64, shape=(None, 3), name="guesses")
    sizes = np.broadcast_to(guesses[:, 2] if radii is None else radii, (len(guesses),))
    sizes = frozen_array(sizes, dtype=np.float64, shape=(None,), name="radii")
    fit = DiscFit.start(np.zeros((len(guesses), model.WIDTH)), np.zeros((len(guesses), 2), dtype=np.int64))
    known = Known.of(len(guesses), np.inf if radii is None else KNOWN_RADIUS)
    _fit(fit, grey, guesses, sizes, known, np.ones(len(guesses), dtype=bool))
    if (clipped := fit.parameters[:, model.LIGHT] >= LIGHTEST).any():
        known = known.lit(fit, fit.settled & (fit.seen >= LEAST_SEEN_UNKNOWN))
        _fit(fit, grey, guesses, sizes, known, clipped)
    return _accepted(fit, guesses, LEAST_SEEN_UNKNOWN if radii is None else LEAST_SEEN)


def _fit(
    fit: DiscFit, grey: GreyImage, guesses: FloatArray, radii: FloatArray, known: Known, chosen: BoolArray
) -> None:
    """Fit the chosen discs; those of about one size at once, which share the shape of their windows."""
    sizes = np.rint(np.log(radii) / np.log(1.4))
    for size in np.unique(sizes[chosen]):
        (alike,) = np.nonzero((sizes == size) & chosen)
        fit.put(alike, fit_discs_of_one_size(grey, guesses[alike, :2], radii[alike], known.at(alike)))


def _accepted(fit: DiscFit, guesses: FloatArray, least_seen: float) -> FittedDiscs:
    """The fitted discs, with NaN for those that fail a check."""
    parameters = fit.parameters
    shade, radii = parameters[:, [model.SHADE_X, model.SHADE_Y]], parameters[:, model.RADIUS]
    # The gradient of the light is blurred as well, which shifts the image of the disc.
    centres = fit.origins + parameters[:, [model.X, model.Y]] + parameters[:, [model.BLUR]] ** 2 * shade
    deviations = np.sqrt(np.linalg.eigvalsh(fit.covariances)[:, 1])
    contrast = parameters[:, model.CONTRAST]
    ratio = radii / guesses[:, 2]
    found = (
        fit.settled
        & (fit.seen >= least_seen)
        & (deviations <= LARGEST_DEVIATION)
        & (np.sqrt(fit.variance) <= LARGEST_RESIDUAL * np.abs(contrast))
        & (np.hypot(*(centres - guesses[:, :2]).T) <= np.maximum(guesses[:, 2], 3))
        & (np.abs(contrast) <= LARGEST_CONTRAST)
        & (ratio >= RADII[0])
        & (ratio <= RADII[1])
    )
    kept = np.where(found, 1.0, np.nan)
    return FittedDiscs(
        centres=centres * kept[:, None],
        covariances=fit.covariances * kept[:, None, None],
        radii=radii * kept,
        contrast=contrast * kept,
        seen=fit.seen,
        found=found,
    )

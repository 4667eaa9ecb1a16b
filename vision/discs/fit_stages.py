"""Fit of discs of about one size: Hough votes, straight edges beside the discs, least squares, outlines."""

import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.vision.discs.correlated_noise import correlated_noise
from pinnray.vision.discs.disc_image_model import BLUR, CONTRAST, COUNT, LIGHT, RADIUS, Array, X, Y
from pinnray.vision.discs.fit_priors import Known, prior_and_limits
from pinnray.vision.discs.hough import HoughVotes, sector, vote_for_centres
from pinnray.vision.discs.irregular_outlines import better_outlines
from pinnray.vision.discs.least_squares import NEAR, DiscFit, coherent_pixels, fit_disc_model, refined_fit
from pinnray.vision.discs.pixel_windows import QUANTISATION, PixelWindows, median_where
from pinnray.vision.discs.straight_edges import with_edges
from pinnray.vision.frames.frame import GreyImage

MARGIN = 6
"""Pixels used on either side of the edge."""
TYPICAL_BLUR = 1.0
"""Initial width of the edge, pixels."""
LEAST_REACH = 4.0
"""Search distance around a guess, pixels; or a radius, if that is more."""
REFINEMENTS = 3
"""Largest number of times that the pixels to use are chosen anew."""
LEAST_VOTES = 0.25
"""Votes that a trusted sector of the edge must have, over those of the better sectors."""
CHANGED = 0.03
"""Share of disagreeing pixels near the edge from which on a disc is fitted again, ..."""
WRONG = 2.0
"""... or variance of the noise that counts for the centre, over that of the fit."""


def fit_discs_of_one_size(grey: GreyImage, guesses: FloatArray, radii: FloatArray, known: Known) -> DiscFit:
    """Fit discs of about one size.

    Args:
        grey: Shape (height, width).
        guesses: x and y, shape (n, 2), pixels.
        radii: Known or guessed, shape (n,), pixels.
        known: Of the discs.
    """
    reach = max(radii.max(), LEAST_REACH)
    votes = vote_for_centres(grey, guesses, radii, reach, known=known.tolerance < np.inf)
    inner, outer = votes.radii.min() - MARGIN, votes.radii.max() + MARGIN
    window = PixelWindows.of(grey, votes.centres, inner, outer)
    trusted = _trusted(window, votes)
    first, residuals = _first_fit(window, votes, trusted, known)
    chosen = coherent_pixels(window, first, residuals)
    outside = window.outside(first.parameters)
    near = np.abs(outside) < NEAR
    changed = ((chosen != trusted) & near).sum(axis=1) > CHANGED * near.sum(axis=1)
    chosen &= trusted
    noise = correlated_noise(window, first, residuals, chosen, votes.radii, known)
    noisy = first.variance > WRONG * np.maximum(window.noise**2, QUANTISATION)
    (again,) = np.nonzero(changed | (noise.max(axis=1) > WRONG) | noisy | ~first.settled)
    if len(again):
        some, votes, their = window.at(again), votes.at(again), known.at(again)
        initial = first.at(again)
        first.put(again, _refined(some, initial, residuals[again], votes.radii, their))
        irregular, outlines, own = better_outlines(
            first.at(again), initial.parameters, some, votes.radii, their
        )
        again = again[irregular]
        if len(again):
            first.put(again, outlines)
            noise[again] = own
    if np.isfinite(noise).any():
        # What a robust fit leaves out shifts a disc as well, so none has less noise than is usual.
        usual = np.maximum(np.nanmedian(noise, axis=0), 1e-3)  # pictures without any noise have none
        inflation = np.fmax(noise, usual).max(axis=1)
        first.covariances *= inflation[:, None, None]
        first.shade_precision /= inflation[:, None]
    return first


def _trusted(window: PixelWindows, votes: HoughVotes) -> BoolArray:
    """Pixels in sectors of the edge that have enough votes, and whose neighbours have, shape (n, p)."""
    good = votes.support >= LEAST_VOTES
    good &= np.roll(good, 1, axis=1) & np.roll(good, -1, axis=1)
    x, y = (window.origins - votes.centres).T[:, :, None]
    sectors = sector(window.x + x, window.y + y)
    return np.asarray(window.within & np.take_along_axis(good, sectors, axis=1))


def _first_fit(
    window: PixelWindows, votes: HoughVotes, trusted: BoolArray, known: Known
) -> tuple[DiscFit, Array]:
    """Fit the trusted pixels, from the voted centres and the levels on either side of the edge."""
    start = np.zeros((len(trusted), COUNT))
    start[:, [X, Y]] = votes.centres - window.origins
    start[:, RADIUS] = votes.radii
    start[:, BLUR] = TYPICAL_BLUR
    outside = window.outside(start)
    start[:, LIGHT] = median_where(window.values, trusted & (outside > 1) & (outside < 3))
    start[:, CONTRAST] = start[:, LIGHT] - median_where(window.values, trusted & (outside < -1))
    start, present = with_edges(window, start, trusted)
    return fit_disc_model(window, start, *prior_and_limits(start, present, votes.radii, known), trusted)


def _refined(
    window: PixelWindows, fit: DiscFit, residuals: Array, radii: FloatArray, known: Known
) -> DiscFit:
    """Fit again to the pixels that agree with the model, after a new search for straight edges."""
    chosen = coherent_pixels(window, fit, residuals)
    ground = chosen | window.within & (window.outside(fit.parameters) > 0)
    start, present = with_edges(window, fit.parameters[:, :COUNT], ground)
    prior, limits = prior_and_limits(start, present, radii, known)
    fit, _ = refined_fit(window, [prior] * REFINEMENTS, start, limits, chosen)
    return fit

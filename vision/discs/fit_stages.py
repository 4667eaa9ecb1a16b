"""Fit of discs of about one size: Hough votes, straight edges beside the discs, least squares, outlines."""

import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.vision.discs.correlated_noise import correlated_noise
from pinnray.vision.discs.disc_image_model import BLUR, CONTRAST, COUNT, LIGHT, RADIUS, Array, X, Y
from pinnray.vision.discs.edge_profile import with_edges
from pinnray.vision.discs.fit_priors import Known, prior_and_limits
from pinnray.vision.discs.ground_texture import without_waves
from pinnray.vision.discs.hough import HoughVotes, sector, vote_for_centres
from pinnray.vision.discs.irregular_outlines import better_outlines
from pinnray.vision.discs.least_squares import (
    NEAR,
    DiscFit,
    coherent_pixels,
    fit_disc_model,
    refined_fit,
)
from pinnray.vision.discs.pixel_windows import QUANTISATION, PixelWindows, median_where
from pinnray.vision.frames.frame import GreyImage

MARGIN = 6
"""Pixels used on either side of the edge."""
TYPICAL_BLUR = 1.0
"""Initial width of the edge, pixels."""
LEAST_REACH = 4.0
"""Search distance around a guess, pixels; or a radius, if that is more."""
REFINEMENTS = 3
"""Largest number of times that the pixels to use are chosen anew."""
LOOSE, STRICT = 0.25, 0.45
"""Votes that a trusted sector of the edge must have, over those of the better sectors: in the first fit, and
in the second fit of discs whose first fit disagrees with the image."""
WAVES = 3
"""Largest number of waves of brightness that are taken out of the ground around a disc."""
UNSURE = 0.25
"""Standard deviation of the shift of a centre by a wave, over the shift: a wave is cut off at an edge that is
known less well than the ground."""
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
    fit = _fit_windows(window, votes, known)
    doubt, waved, smooth = np.zeros_like(fit.covariances), np.arange(len(radii)), window
    for _ in range(WAVES):
        smooth, found = without_waves(smooth, fit.parameters[waved])
        if not len(found):
            break
        waved = waved[found]
        before, now = fit.at(waved), _fit_windows(smooth, votes.at(waved), known.at(waved))
        less = now.variance * before.seen < before.variance * now.seen  # what is left out has no variance
        (better,) = np.nonzero(now.settled & less | ~before.settled)
        smooth, waved, now = smooth.at(better), waved[better], now.at(better)
        astray = UNSURE * (now.parameters - before.at(better).parameters)[:, [X, Y]]
        doubt[waved] += astray[:, :, None] * astray[:, None]
        fit.put(waved, now)
        if not len(waved):
            break
    fit.covariances += doubt
    return fit


def _fit_windows(window: PixelWindows, votes: HoughVotes, known: Known) -> DiscFit:
    """Fit discs to the pixels around them, from their votes."""
    trusted = _trusted(window, votes, LOOSE)
    first, residuals = _first_fit(window, votes, trusted, known)
    chosen = coherent_pixels(window, first, residuals)
    outside = window.outside(first.parameters)
    near = np.abs(outside) < NEAR
    changed = ((chosen != trusted) & near).sum(axis=1) > CHANGED * near.sum(axis=1)
    chosen &= trusted
    noise = correlated_noise(window, first, residuals, chosen, votes.radii, known)
    noisy = first.variance > WRONG * np.maximum(window.noise**2, QUANTISATION)
    (again,) = np.nonzero(changed | (noise.misfit > WRONG) | noisy | ~first.settled)
    if len(again):
        some, votes, their = window.at(again), votes.at(again), known.at(again)
        initial = first.at(again)
        either = _refined(some, initial, residuals[again], votes.radii, their)
        first.put(again, either)
        strict = _trusted(some, votes, STRICT)
        (fewer,) = np.nonzero((strict != trusted[again]).any(axis=1))
        if len(fewer):
            few = some.at(fewer), votes.at(fewer), their.at(fewer)
            second = _first_fit(*few[:2], strict[fewer], few[2])
            other = _refined(few[0], *second, few[1].radii, few[2])
            (better,) = np.nonzero(_deviation(other) < _deviation(either.at(fewer)))
            first.put(again[fewer[better]], other.at(better))
        irregular, outlines, own = better_outlines(
            first.at(again), initial.parameters, some, votes.radii, their
        )
        again = again[irregular]
        if len(again):
            first.put(again, outlines)
            noise.variance[again], noise.squares[again] = own.variance, own.squares
    inflation = noise.pooled
    first.covariances *= inflation[:, None, None]
    first.shade_precision /= inflation[:, None]
    return first


def _deviation(fit: DiscFit) -> FloatArray:
    """Root mean square standard deviation of the centres, shape (n,), pixels; infinite if not settled."""
    variance = np.trace(fit.covariances, axis1=1, axis2=2) / 2
    return np.asarray(np.sqrt(np.where(fit.settled, variance, np.inf)))


def _trusted(window: PixelWindows, votes: HoughVotes, least: float) -> BoolArray:
    """Pixels in sectors of the edge that have enough votes, and whose neighbours have, shape (n, p)."""
    good = votes.support >= least
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

"""Fit of discs of about one size: Hough votes, straight edges beside the discs, least squares."""

import numpy as np

from geometry.arrays import BoolArray, FloatArray
from vision.discs.disc_image_model import (
    BLUR,
    CONTRAST,
    COUNT,
    EDGES,
    LIGHT,
    RADIUS,
    SHADE_X,
    SHADE_Y,
    SLANT,
    STRETCH,
    Array,
    X,
    Y,
)
from vision.discs.hough import HoughVotes, sector, vote_for_centres
from vision.discs.least_squares import DiscFit, DiscPrior, coherent_pixels, fit_disc_model, noise_correlation
from vision.discs.pixel_windows import PixelWindows, median_where
from vision.discs.straight_edges import with_edges
from vision.frames.frame import GreyImage

MARGIN = 6
"""Pixels used on either side of the edge."""
DEVIATIONS = {STRETCH: 0.05, SLANT: 0.05, BLUR: 5.0, SHADE_X: 0.05, SHADE_Y: 0.05}
"""Prior standard deviations, about zero but for the blur. They matter where little of the edge is seen."""
TYPICAL_BLUR = 1.0
"""Initial width of the edge, pixels."""
LEAST_REACH = 4.0
"""Search distance around a guess, pixels; or a radius, if that is more."""
STEPS = {X: 1.0, Y: 1.0, STRETCH: 0.3, SLANT: 0.3, BLUR: 0.7, SHADE_X: 0.02, SHADE_Y: 0.02}
"""Longest steps of an iteration."""
EDGE_DEVIATIONS, EDGE_STEPS, MISSING = (0.5, 1.5, 100.0), (0.3, 1.0, 1e3), 1e-3
"""The same for straight edges: rad, pixels, grey levels; and the deviation of all of an absent edge."""
REFINEMENTS = 3
"""Largest number of times that the pixels to use are chosen anew."""
NEAR = 2.0
"""Pixels from the edge within which the noise matters most."""
LOOSE, STRICT = 0.25, 0.45
"""Votes that a trusted sector of the edge must have, over those of the better sectors: in the first fit, and
in the second fit of discs whose first fit disagrees with the image."""
CHANGED = 0.03
"""Share of disagreeing pixels near the edge from which on a disc is fitted again."""


def fit_discs_of_one_size(
    grey: GreyImage, guesses: FloatArray, radii: FloatArray, tolerance: float
) -> DiscFit:
    """Fit discs of about one size.

    Args:
        grey: Shape (height, width).
        guesses: x and y, shape (n, 2), pixels.
        radii: Known or guessed, shape (n,), pixels.
        tolerance: Relative standard deviation of the radii; infinite if they are guessed.
    """
    reach = max(radii.max(), LEAST_REACH)
    votes = vote_for_centres(grey, guesses, radii, reach, known=tolerance < np.inf)
    inner, outer = votes.radii.min() - MARGIN, votes.radii.max() + MARGIN
    window = PixelWindows.of(grey, votes.centres, inner, outer)
    trusted = _trusted(window, votes, LOOSE)
    first, residuals = _first_fit(window, votes, trusted, tolerance)
    chosen = coherent_pixels(window, first, residuals)
    near = np.abs(_distance_outside(window, first.parameters)) < NEAR
    (again,) = np.nonzero(((chosen != trusted) & near).sum(axis=1) > CHANGED * near.sum(axis=1))
    inflation = noise_correlation(window, first, residuals, chosen & trusted, near)
    if len(again):
        window, votes = window.at(again), votes.at(again)
        second = _first_fit(window, votes, _trusted(window, votes, STRICT), tolerance)
        either = _refined(window, first.at(again), residuals[again], votes.radii, tolerance)
        other = _refined(window, *second, votes.radii, tolerance)
        first.put(again, either)
        (better,) = np.nonzero(_deviation(other) < _deviation(either))
        first.put(again[better], other.at(better))
    first.covariances *= inflation
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
    window: PixelWindows, votes: HoughVotes, trusted: BoolArray, tolerance: float
) -> tuple[DiscFit, Array]:
    """Fit the trusted pixels, from the voted centres and the levels on either side of the edge."""
    start = np.zeros((len(trusted), COUNT))
    start[:, [X, Y]] = votes.centres - window.origins
    start[:, RADIUS] = votes.radii
    start[:, BLUR] = TYPICAL_BLUR
    outside = _distance_outside(window, start)
    start[:, LIGHT] = median_where(window.values, trusted & (outside > 1) & (outside < 3))
    start[:, CONTRAST] = start[:, LIGHT] - median_where(window.values, trusted & (outside < -1))
    start, present = with_edges(window, start, trusted)
    return fit_disc_model(window, start, *_prior_and_limits(start, present, votes.radii, tolerance), trusted)


def _refined(
    window: PixelWindows, fit: DiscFit, residuals: Array, radii: FloatArray, tolerance: float
) -> DiscFit:
    """Fit again to the pixels that agree with the model, after a new search for straight edges."""
    chosen = coherent_pixels(window, fit, residuals)
    ground = chosen | window.within & (_distance_outside(window, fit.parameters) > 0)
    start, present = with_edges(window, fit.parameters[:, :COUNT], ground)
    prior, limits = _prior_and_limits(start, present, radii, tolerance)
    for _ in range(REFINEMENTS):
        fit, residuals = fit_disc_model(window, start, prior, limits, chosen)
        start, chosen = fit.parameters, coherent_pixels(window, fit, residuals)
    return fit


def _distance_outside(window: PixelWindows, parameters: FloatArray) -> FloatArray:
    """Distance of the pixels from the circles, positive outside, shape (n, p)."""
    x, y, radius = parameters[:, [X, Y, RADIUS]].T[:, :, None]
    return np.asarray(np.hypot(window.x - x, window.y - y) - radius, dtype=np.float64)


def _prior_and_limits(
    start: FloatArray, present: BoolArray, radii: FloatArray, tolerance: float
) -> tuple[DiscPrior, FloatArray]:
    """Prior of the parameters, and their longest steps; absent edges keep zero contrast."""
    mean, deviations, limits = start.copy(), np.full(start.shape, 1e3), np.full(start.shape, 1e3)
    mean[:, [STRETCH, SLANT, SHADE_X, SHADE_Y]] = 0
    mean[:, RADIUS] = radii
    deviations[:, list(DEVIATIONS)] = list(DEVIATIONS.values())
    deviations[:, RADIUS] = np.minimum(tolerance * radii, 1e3)
    edges = np.where(present[:, :, None], EDGE_DEVIATIONS, MISSING)
    deviations[:, COUNT:] = edges.reshape(len(start), -1)
    limits[:, list(STEPS)] = list(STEPS.values())
    limits[:, RADIUS] = np.maximum(0.5, 0.2 * radii)
    limits[:, COUNT:] = EDGE_STEPS * EDGES
    return DiscPrior(mean, deviations**-2.0), limits

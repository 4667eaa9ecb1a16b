"""The fit of discs of about one size: votes for the centres, edges beside the discs, then least squares."""

import numpy as np

from geometry.arrays import BoolArray, FloatArray
from vision.discs.disc_image_model import (
    BLUR,
    CONTRAST,
    COUNT,
    LIGHT,
    RADIUS,
    SHADE_X,
    SHADE_Y,
    SLANT,
    STRETCH,
    X,
    Y,
)
from vision.discs.hough import HoughVotes, sector, vote_for_centres
from vision.discs.least_squares import DiscAdjustment, DiscFit, DiscPrior, adjust, coherent, correlation
from vision.discs.pixel_windows import PixelWindows, median_where
from vision.discs.straight_edges import with_edges
from vision.frames.frame import GreyImage

MARGIN = 6
"""Pixels used on either side of the edge."""

DEVIATIONS = {STRETCH: 0.05, SLANT: 0.05, BLUR: 5.0, SHADE_X: 0.05, SHADE_Y: 0.05}
"""What is assumed of a disc: standard deviations, about zero but for the blur. They matter only where little
of the edge is seen."""

TYPICAL_BLUR = 1.0
"""Width of the edge, pixels, to start with."""

LEAST_REACH = 4.0
"""How far from its guess a disc is sought, pixels; or a radius, if that is more."""

STEPS = {X: 1.0, Y: 1.0, STRETCH: 0.3, SLANT: 0.3, BLUR: 0.7, SHADE_X: 0.02, SHADE_Y: 0.02}
"""Longest steps of an iteration."""

EDGE_DEVIATIONS, EDGE_STEPS, MISSING = (0.5, 1.5, 100.0), (0.3, 1.0, 1e3), 1e-3
"""The same for straight edges: rad, pixels, grey levels; and the deviation of all where there is none."""

LENIENT = 2
"""First steps, in which the noise may be as large as the residuals say."""

REFINEMENTS = 3
"""How often the pixels to use are chosen anew, at most."""

NEAR = 2.0
"""Pixels from the edge within which the noise matters most."""

LOOSE, STRICT = 0.25, 0.45
"""Votes that a sector of the edge must have, over those of the better sectors, to be trusted: at first, and
where that led to a picture that does not agree with the image."""

CHANGED = 0.03
"""Share of the pixels near the edge that disagree, from which on a disc is fitted again."""


def fit_alike(grey: GreyImage, guesses: FloatArray, radii: FloatArray, tolerance: float) -> DiscFit:
    """Fit discs of about one size.

    Args:
        grey: Shape (height, width).
        guesses: x and y, shape (n, 2), pixels.
        radii: Known or guessed, shape (n,), pixels.
        tolerance: Relative standard deviation of the radii; infinite if they are guessed.
    """
    reach = max(radii.max(), LEAST_REACH)
    election = vote_for_centres(grey, guesses, radii, reach, known=tolerance < np.inf)
    smallest, largest = election.radii.min(), election.radii.max()
    window = PixelWindows.of(grey, election.centres, smallest - MARGIN, largest + MARGIN)
    trusted = _trusted(window, election, LOOSE)
    first = _first(window, election, trusted, tolerance)
    chosen = coherent(window, first)
    near = np.abs(_outside(window, first.parameters)) < NEAR
    (again,) = np.nonzero(((chosen != trusted) & near).sum(axis=1) > CHANGED * near.sum(axis=1))
    inflation = correlation(window, first, chosen & trusted, near)
    if len(again):
        window, election = window.at(again), election.at(again)
        anew = _first(window, election, _trusted(window, election, STRICT), tolerance)
        either, other = (_refined(window, now, election.radii, tolerance) for now in (first.at(again), anew))
        first.fit.put(again, either)
        (better,) = np.nonzero(_deviation(other) < _deviation(either))
        first.fit.put(again[better], other.at(better))
    first.fit.covariances *= inflation
    return first.fit


def _deviation(fit: DiscFit) -> FloatArray:
    """Root mean square standard deviation of the centres, shape (n,), pixels; infinite if not settled."""
    variance = np.trace(fit.covariances, axis1=1, axis2=2) / 2
    return np.asarray(np.sqrt(np.where(fit.settled, variance, np.inf)))


def _trusted(window: PixelWindows, election: HoughVotes, least: float) -> BoolArray:
    """The pixels in sectors of the edge that have enough support, and whose neighbours have, shape (n, p)."""
    good = election.support >= least
    good &= np.roll(good, 1, axis=1) & np.roll(good, -1, axis=1)
    x, y = (window.origins - election.centres).T[:, :, None]
    sectors = sector(window.x + x, window.y + y)
    return np.asarray(window.within & np.take_along_axis(good, sectors, axis=1))


def _first(
    window: PixelWindows, election: HoughVotes, trusted: BoolArray, tolerance: float
) -> DiscAdjustment:
    """Adjust to the trusted pixels, from the elected centres and the levels on either side of the edge."""
    start = np.zeros((len(trusted), COUNT))
    start[:, [X, Y]] = election.centres - window.origins
    start[:, RADIUS] = election.radii
    start[:, BLUR] = TYPICAL_BLUR
    outside = _outside(window, start)
    start[:, LIGHT] = median_where(window.values, trusted & (outside > 1) & (outside < 3))
    start[:, CONTRAST] = start[:, LIGHT] - median_where(window.values, trusted & (outside < -1))
    start, present = with_edges(window, start, trusted)
    return adjust(window, start, *_prior(start, present, election.radii, tolerance), trusted, LENIENT)


def _refined(window: PixelWindows, now: DiscAdjustment, radii: FloatArray, tolerance: float) -> DiscFit:
    """Adjust again to whatever agrees with the picture, once the edges have been looked for anew."""
    chosen = coherent(window, now)
    ground = chosen | window.within & (_outside(window, now.parameters) > 0)
    start, present = with_edges(window, now.parameters[:, :COUNT], ground)
    prior, limits = _prior(start, present, radii, tolerance)
    for _ in range(REFINEMENTS):
        now = adjust(window, start, prior, limits, chosen, LENIENT)
        start, chosen = now.parameters, coherent(window, now)
    return now.fit


def _outside(window: PixelWindows, parameters: FloatArray) -> FloatArray:
    """Distance of the pixels from the circles, positive outside, shape (n, p)."""
    x, y, radius = parameters[:, [X, Y, RADIUS]].T[:, :, None]
    return np.asarray(np.hypot(window.x - x, window.y - y) - radius, dtype=np.float64)


def _prior(
    start: FloatArray, present: BoolArray, radii: FloatArray, tolerance: float
) -> tuple[DiscPrior, FloatArray]:
    """What is assumed of the parameters, and their longest steps; missing edges stay without strength."""
    mean, deviations, limits = start.copy(), np.full(start.shape, 1e3), np.full(start.shape, 1e3)
    mean[:, [STRETCH, SLANT, SHADE_X, SHADE_Y]] = 0
    mean[:, RADIUS] = radii
    deviations[:, list(DEVIATIONS)] = list(DEVIATIONS.values())
    deviations[:, RADIUS] = np.minimum(tolerance * radii, 1e3)
    edges = np.where(present[:, :, None], EDGE_DEVIATIONS, MISSING)
    deviations[:, COUNT:] = edges.reshape(len(start), -1)
    limits[:, list(STEPS)] = list(STEPS.values())
    limits[:, RADIUS] = np.maximum(0.5, 0.2 * radii)
    limits[:, COUNT:] = EDGE_STEPS * present.shape[1]
    return DiscPrior(mean, deviations**-2.0), limits

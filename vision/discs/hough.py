"""Hough votes for the centres of discs, to a fraction of a pixel, from guesses that are off by several.

Every pixel with a gradient votes for the point at the distance of the radius along it. The votes of an arc
agree on its centre, whatever hides the rest of the circle; those of straight edges agree on nothing. Units:
pixels.

Source: D. H. Ballard, "Generalizing the Hough transform to detect arbitrary shapes", Pattern Recognition 13,
1981, for circles of one size.
"""

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.vision.frames.frame import GreyImage

SECTORS = 16
"""Sectors of the edge whose votes are counted separately."""
SPREAD = 1.0
"""Standard deviation of the smoothing, of the image before its derivatives and of the votes."""
NEAR = 2
"""Largest distance along either axis at which a vote supports a centre."""
WEAK = 0.15
"""Pixels below this fraction of the largest gradient cast no vote."""
UNCERTAINTY = 0.3
"""Relative uncertainty of a guessed radius."""
MARGIN = 3
"""Reach of the smoothing."""

Floats = NDArray[np.floating[Any]]


class HoughVotes(NamedTuple):
    """Result of the votes.

    Attributes:
        centres: x, y, shape (n, 2).
        radii: Shape (n,).
        support: Votes of the sectors of the edge over those of the better sectors, shape (n, `SECTORS`),
            counted from the x axis toward y.
    """

    centres: FloatArray
    radii: FloatArray
    support: FloatArray

    def at(self, places: IntArray) -> "HoughVotes":
        """The votes for some discs."""
        return HoughVotes(*(part[places] for part in self))


def vote_for_centres(
    grey: GreyImage, guesses: FloatArray, radii: FloatArray, reach: float, *, known: bool
) -> HoughVotes:
    """Find the best centres at most `reach` pixels from the guesses along either axis.

    Args:
        grey: Shape (height, width).
        guesses: x and y, shape (n, 2).
        radii: Of the discs, shape (n,).
        reach: Pixels.
        known: Whether the radii are right; else they may be off by a fifth.
    """
    count, origins = len(guesses), np.rint(guesses).astype(np.int64)
    half = int(np.ceil(radii.max() + reach)) + NEAR
    line = np.arange(-half - MARGIN, half + MARGIN + 1)
    height, width = grey.shape
    rows = np.clip(origins[:, 1, None] + line, 0, height - 1)
    columns = np.clip(origins[:, 0, None] + line, 0, width - 1)
    gradient_x, gradient_y = _gradients(grey[rows[:, :, None], columns[:, None, :]].astype(np.float32))
    strength = np.hypot(gradient_x, gradient_y) + np.float32(1e-3)
    line = line[MARGIN:-MARGIN]
    away = [radii[:, None, None] * gradient / strength for gradient in (gradient_x, gradient_y)]
    most = int(np.ceil(reach))
    # Gradients point out of dark discs and into light ones: vote for both, and take the denser peak.
    (dark, dark_votes), (light, light_votes) = (
        _densest(line - sign * away[0], line[:, None] - sign * away[1], strength, most) for sign in (1, -1)
    )
    is_dark = dark_votes >= light_votes
    sign = np.where(is_dark, 1, -1)[:, None, None]
    centres = np.where(is_dark[:, None], dark, light)
    x, y = line - centres[:, 0, None, None], line[:, None] - centres[:, 1, None, None]
    distance = np.hypot(x, y) + 1e-3
    outward = np.maximum(sign * (gradient_x * x + gradient_y * y) / distance, 0)
    if not known:
        radii = _radii(distance, outward, radii)
    near = np.abs(distance - radii[:, None, None]) <= NEAR
    agree = near & (outward > 0.8 * strength)
    sectors = sector(x, y) + SECTORS * np.arange(count)[:, None, None]
    support = np.bincount(sectors[agree], weights=outward[agree], minlength=count * SECTORS)
    support = support.reshape(count, SECTORS)
    better = np.sort(support, axis=1)[:, -SECTORS // 4, None]
    return HoughVotes(origins + centres, radii, support / np.maximum(better, 1e-9))


def sector(x: Floats, y: Floats) -> IntArray:
    """Number of the sector that holds a direction."""
    turns = np.arctan2(y, x) * (SECTORS / (2 * np.pi))
    return np.asarray(np.floor(turns + 0.5).astype(np.int64) % SECTORS)


def _radii(distance: Floats, outward: Floats, guesses: FloatArray) -> FloatArray:
    """Distance near the guess at which the mean radial gradient is greatest, shape (n,)."""
    count, bins = len(distance), int(np.ceil(2 * distance.max())) + 1
    places = ((2 * distance + 0.5).astype(np.int64) + bins * np.arange(count)[:, None, None]).ravel()
    sums = np.bincount(places, weights=outward.ravel(), minlength=count * bins)
    areas = np.bincount(places, minlength=count * bins).astype(np.float64)
    smooth_sums, smooth_areas = (
        cv2.GaussianBlur(part.reshape(count, bins), (9, 1), 2 * SPREAD) for part in (sums, areas)
    )
    radii = np.arange(bins) / 2
    near = np.abs(radii / guesses[:, None] - 1) < UNCERTAINTY
    best = np.where(near, smooth_sums / np.maximum(smooth_areas, 1), -1).argmax(axis=1)
    return np.asarray(np.maximum(radii[best], 0.5))


def _gradients(tiles: Floats) -> tuple[Floats, Floats]:
    """Derivatives along x and y of smoothed tiles, without their margin."""
    places = np.arange(-MARGIN, MARGIN + 1.0)
    bell = np.exp(-(places**2) / (2 * SPREAD**2))
    count, side = tiles.shape[:2]
    strip = tiles.reshape(count * side, side)

    def derivative(along_x: FloatArray, along_y: FloatArray) -> Floats:
        filtered = cv2.sepFilter2D(strip, cv2.CV_32F, along_x, along_y).reshape(count, side, side)
        return np.asarray(filtered[:, MARGIN:-MARGIN, MARGIN:-MARGIN], dtype=np.float32)

    return derivative(places * bell, bell), derivative(bell, places * bell)


def _densest(x: Floats, y: Floats, strength: Floats, most: int) -> tuple[FloatArray, FloatArray]:
    """Places of the densest smoothed votes, shape (n, 2), and their densities, shape (n,)."""
    count = len(x)
    side = 2 * (most + MARGIN) + 1
    column, row = (np.rint(votes).astype(np.int64) + most + MARGIN for votes in (x, y))
    valid = strength > WEAK * strength.max(axis=(1, 2), keepdims=True)
    valid &= (column >= 0) & (column < side) & (row >= 0) & (row < side)
    places = (np.arange(count)[:, None, None] * side + row) * side + column
    votes = np.bincount(places[valid], weights=strength[valid], minlength=count * side * side)
    strip = votes.astype(np.float64).reshape(count * side, side)
    density = np.asarray(cv2.GaussianBlur(strip, (2 * MARGIN + 1,) * 2, SPREAD), dtype=np.float64)
    density = density.reshape(count, side, side)
    inner = density[:, MARGIN:-MARGIN, MARGIN:-MARGIN].reshape(count, -1)
    best, each = inner.argmax(axis=1), np.arange(count)
    row, column = np.array(np.divmod(best, side - 2 * MARGIN)) + MARGIN
    return np.stack([column, row], axis=1).astype(np.float64) - (most + MARGIN), inner[each, best]

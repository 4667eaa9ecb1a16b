"""Where discs of known size are, to a fraction of a pixel, from guesses that are off by several: by voting.

Every pixel with a gradient votes for the point that lies a radius away along it. What the votes of an arc
agree on is its centre, whatever hides the rest of it, and straight edges agree on nothing. Units: pixels.

Source: D. H. Ballard, "Generalizing the Hough transform to detect arbitrary shapes", Pattern Recognition 13,
1981, for circles of one size.
"""

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from geometry.arrays import BoolArray, FloatArray, IntArray
from vision.frames.frame import GreyImage

SECTORS = 16
"""Parts of the edge whose votes are counted apart."""

SPREAD = 1.0
"""Standard deviation of the smoothing, of the image before its derivatives and of the votes."""

NEAR = 2
"""Votes agree on a centre that they miss by at most so much along either axis."""

WEAK = 0.15
"""Of the steepest slope: what is less does not vote."""

UNCERTAINTY = 0.3
"""Of a radius that is guessed, relative."""

KERNEL = np.arange(-3.0, 4.0)

Floats = NDArray[np.floating[Any]]


class HoughVotes(NamedTuple):
    """What the votes agree on.

    Attributes:
        centres: x, y, shape (n, 2).
        radii: Shape (n,).
        dark: Whether the disc is darker than what surrounds it, shape (n,).
        support: Votes of the sectors of the edge over those of the better sectors, shape (n, `SECTORS`),
            counted from the x axis toward y.
    """

    centres: FloatArray
    radii: FloatArray
    dark: BoolArray
    support: FloatArray

    def at(self, places: IntArray) -> "HoughVotes":
        """That of some discs."""
        return HoughVotes(self.centres[places], self.radii[places], self.dark[places], self.support[places])


def vote_for_centres(
    grey: GreyImage, guesses: FloatArray, radii: FloatArray, reach: float, *, known: bool
) -> HoughVotes:
    """The best centres at most `reach` pixels from the guesses along either axis.

    Args:
        grey: Shape (height, width).
        guesses: x and y, shape (n, 2).
        radii: Of the discs, shape (n,).
        reach: Pixels.
        known: Whether the radii are right; else they may be off by a fifth.
    """
    count, origins = len(guesses), np.rint(guesses).astype(np.int64)
    half = int(np.ceil(radii.max() + reach)) + NEAR
    line = np.arange(-half - 3, half + 4)
    height, width = grey.shape
    rows = np.clip(origins[:, 1, None] + line, 0, height - 1)
    columns = np.clip(origins[:, 0, None] + line, 0, width - 1)
    tiles = grey[rows[:, None, :].transpose(0, 2, 1), columns[:, None, :]].astype(np.float32)
    slopes_x, slopes_y = _slopes(tiles)
    strength = np.hypot(slopes_x, slopes_y) + np.float32(1e-3)
    line = line[3:-3]
    away = [radii[:, None, None] * slope / strength for slope in (slopes_x, slopes_y)]
    most = int(np.ceil(reach))
    polls = [_poll(line - sign * away[0], line[:, None] - sign * away[1], strength, most) for sign in (1, -1)]
    dark = polls[0][1] >= polls[1][1]
    sign = np.where(dark, 1, -1)[:, None, None]
    centres = np.where(dark[:, None], polls[0][0], polls[1][0])
    x, y = line - centres[:, 0, None, None], line[:, None] - centres[:, 1, None, None]
    distance = np.hypot(x, y) + 1e-3
    outward = np.maximum(sign * (slopes_x * x + slopes_y * y) / distance, 0)
    if not known:
        radii = _radii(distance, outward, radii)
    near = np.abs(distance - radii[:, None, None]) <= NEAR
    agree = near & (outward > 0.8 * strength)
    sectors = sector(x, y) + SECTORS * np.arange(count)[:, None, None]
    support = np.bincount(sectors[agree], weights=outward[agree], minlength=count * SECTORS)
    support = support.reshape(count, SECTORS)
    better = np.sort(support, axis=1)[:, -SECTORS // 4, None]
    return HoughVotes(origins + centres, radii, dark, support / np.maximum(better, 1e-9))


def sector(x: Floats, y: Floats) -> IntArray:
    """Number of the sector that holds a direction."""
    turns = np.arctan2(y, x) * (SECTORS / (2 * np.pi))
    return np.asarray(np.floor(turns + 0.5).astype(np.int64) % SECTORS)


def _radii(distance: Floats, outward: Floats, guesses: FloatArray) -> FloatArray:
    """Where the mean slope along the rays is greatest, near the guess, shape (n,)."""
    count, bins = len(distance), int(np.ceil(2 * distance.max())) + 1
    places = (2 * distance + 0.5).astype(np.int64) + bins * np.arange(count)[:, None, None]
    sums = np.bincount(places.ravel(), weights=outward.ravel(), minlength=count * bins)
    areas = np.bincount(places.ravel(), minlength=count * bins).astype(np.float64)
    smooth_sums, smooth_areas = (
        cv2.GaussianBlur(part.reshape(count, bins), (9, 1), 2 * SPREAD) for part in (sums, areas)
    )
    radii = np.arange(bins) / 2
    near = np.abs(radii / guesses[:, None] - 1) < UNCERTAINTY
    best = np.where(near, smooth_sums / np.maximum(smooth_areas, 1), -1).argmax(axis=1)
    return np.asarray(np.maximum(radii[best], 0.5))


def _slopes(tiles: Floats) -> tuple[Floats, Floats]:
    """Derivatives along x and y of smoothed tiles, without their margin of three pixels."""
    bell = np.exp(-(KERNEL**2) / (2 * SPREAD**2))
    count, side = tiles.shape[:2]
    strip = tiles.reshape(count * side, side)

    def derivative(along_x: FloatArray, along_y: FloatArray) -> Floats:
        filtered = cv2.sepFilter2D(strip, cv2.CV_32F, along_x, along_y).reshape(count, side, side)
        return np.asarray(filtered[:, 3:-3, 3:-3], dtype=np.float32)

    return derivative(KERNEL * bell, bell), derivative(bell, KERNEL * bell)


def _poll(x: Floats, y: Floats, strength: Floats, most: int) -> tuple[FloatArray, FloatArray]:
    """Where the smoothed votes are densest, shape (n, 2), and how dense, shape (n,)."""
    count, margin = len(x), 3
    side = 2 * (most + margin) + 1
    column, row = (np.rint(votes).astype(np.int64) + most + margin for votes in (x, y))
    valid = strength > WEAK * strength.max(axis=(1, 2), keepdims=True)
    valid &= (column >= 0) & (column < side) & (row >= 0) & (row < side)
    places = (np.arange(count)[:, None, None] * side + row) * side + column
    votes = np.bincount(places[valid], weights=strength[valid], minlength=count * side * side).astype(
        np.float64
    )
    strip = cv2.GaussianBlur(votes.reshape(count * side, side), (2 * margin + 1,) * 2, SPREAD)
    density = np.asarray(strip, dtype=np.float64).reshape(count, side, side)
    inner = density[:, margin:-margin, margin:-margin].reshape(count, -1)
    best = inner.argmax(axis=1)
    row, column = np.divmod(best, side - 2 * margin)
    each, row, column = np.arange(count), row + margin, column + margin
    peak = inner[each, best]

    def vertex(before: FloatArray, after: FloatArray) -> FloatArray:
        curvature = np.maximum(2 * peak - before - after, 1e-9 + 0.1 * peak)
        return np.asarray(0.5 * (after - before) / curvature)

    shift_x = vertex(density[each, row, column - 1], density[each, row, column + 1])
    shift_y = vertex(density[each, row - 1, column], density[each, row + 1, column])
    centres = np.stack([column + shift_x, row + shift_y], axis=1) - (most + margin)
    return centres, peak

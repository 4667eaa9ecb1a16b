"""Mean residual along the edges of discs, by the distance from the edge and by how the edge bends.

An edge that is sharpened, or has another profile than the model's, and the blur of an outline that bends
leave residuals that all discs share. They are alike all along an edge, so they do not move a centre, but
neighbouring pixels share them as they share noise. Units: pixels, grey levels.
"""

import numpy as np

from geometry.arrays import BoolArray, FloatArray
from vision.discs.disc_image_model import (
    CONTRAST,
    DIRECTIONS,
    RADIUS,
    SLANT,
    STRETCH,
    Array,
    X,
    Y,
    outline,
)
from vision.discs.pixel_windows import PixelWindows

PROFILE = 0.25
"""Width of the classes of the distance from the edge, pixels."""
SHRINK = 10.0
"""Pixels of no residual that are added to every class: few pixels show noise, not a profile."""
FAINT = 1e-6
"""The same where there is no contrast."""


def edge_profile(
    window: PixelWindows, parameters: FloatArray, residuals: Array, noise: Array, chosen: BoolArray
) -> FloatArray:
    """Mean residuals over the contrast in classes of the distance, linear in bend and squared slope.

    Args:
        window: The pixels.
        parameters: Of the discs, with the columns of an irregular outline, shape (n, m).
        residuals: Of the pixels, shape (n, p), over their noise.
        noise: Standard deviations, shape (n, 1), grey levels.
        chosen: Pixels that belong to the model, shape (n, p).

    Returns:
        The part of the residuals of each pixel that follows from its place, shape (n, p), over the noise.
    """
    radius, a, b, contrast = parameters[:, [RADIUS, STRETCH, SLANT, CONTRAST]].T[:, :, None]
    twice, step = 2 * DIRECTIONS, DIRECTIONS[1]
    shape = outline(parameters) / np.sqrt(np.sqrt(1 + a * a + b * b) - a * np.cos(twice) - b * np.sin(twice))
    before, after = np.roll(shape, 1, axis=1), np.roll(shape, -1, axis=1)
    bend = shape - 1 - (before - 2 * shape + after) / step**2  # curvature times radius, less that of a circle
    slope = (after - before) / (2 * step)
    dx, dy = window.x - parameters[:, [X]], window.y - parameters[:, [Y]]
    turn = np.rint(np.arctan2(dy, dx) / step).astype(int) % len(DIRECTIONS)
    edge, bend, steep = (np.take_along_axis(part, turn, axis=1) for part in (shape, bend, slope**2))
    places = np.floor((np.hypot(dx, dy) - radius * edge) / PROFILE).astype(int)
    places -= places.min()
    signal = contrast / noise
    terms = signal * np.stack([np.ones_like(edge), bend, steep])
    sizes, some = places.max() + 1, places[chosen]

    def sums(values: FloatArray) -> FloatArray:
        """Sums over the chosen pixels of every class."""
        return np.bincount(some, weights=values[chosen], minlength=sizes).astype(np.float64)

    normal = np.stack([np.stack([sums(one * other) for one in terms], -1) for other in terms], -1)
    normal += (SHRINK * np.median(signal**2) + FAINT) * np.eye(len(terms))
    pull = np.stack([sums(term * residuals) for term in terms], axis=-1)
    heights = np.linalg.solve(normal, pull[:, :, None])[:, :, 0]
    return np.asarray((heights.T[:, places] * terms).sum(axis=0) * chosen)

"""Residuals of the disc model at edges: their mean profile, and straight edges beside the disc.

An edge that is sharpened, or has another profile than the model's, and the blur of an outline that bends
leave residuals that all discs share. They are alike all along an edge, so they do not move a centre, but
neighbouring pixels share them as they share noise. Straight edges, such as those of the wall with the disc,
are found by greedy orthogonal matching pursuit: of many half-planes, the one that reduces the residuals most,
then a second; what the disc itself could explain by moving is projected out first.

Source: Y. C. Pati, R. Rezaiifar, P. S. Krishnaprasad, "Orthogonal matching pursuit", Asilomar Conference
1993. Units: pixels, grey levels.
"""

import numpy as np
from scipy.special import ndtr

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.vision.discs.disc_image_model import (
    BLUR,
    CONTRAST,
    DIRECTIONS,
    EDGE,
    EDGES,
    LIGHT,
    RADIUS,
    SLANT,
    STRETCH,
    Array,
    X,
    Y,
    disc_image,
    outline,
)
from pinnray.vision.discs.pixel_windows import LIGHTEST, QUANTISATION, PixelWindows

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


ANGLES, OFFSETS = 24, np.arange(0.75, 4.0, 0.5)
"""Half-planes that are tried: number of directions of the normal, and pixels between disc and edge."""
GAIN = 30.0
"""Sum of squares that an edge must explain, over the variance of the noise."""
CLIPPED = 0.5
"""Share of unclipped pixels beyond an edge that a clipped ground needs to show it."""


def with_edges(
    window: PixelWindows, parameters: FloatArray, trusted: BoolArray
) -> tuple[FloatArray, BoolArray]:
    """Add the parameters of the edges.

    Args:
        window: The pixels around the discs.
        parameters: Of the discs alone, near the solution, shape (n, m).
        trusted: Pixels that may be used, shape (n, p).

    Returns:
        Parameters with two edges, shape (n, m + 6), and a mask of the edges that were found, shape (n, 2).
    """
    angles, gaps = (a.ravel() for a in np.meshgrid(np.arange(ANGLES) * 2 * np.pi / ANGLES, OFFSETS))
    offsets = gaps + np.median(parameters[:, RADIUS])
    some = slice(None, None, 2)  # half of the pixels are enough
    x, y, used = window.x[some], window.y[some], trusted[:, some]
    across = np.outer(np.cos(angles), x) + np.outer(np.sin(angles), y)
    tried = ndtr((across - offsets[:, None]).astype(np.float32) / np.float32(np.median(parameters[:, BLUR])))
    levels, known = disc_image(parameters.astype(np.float32), x, y)
    known *= used[:, None]
    residuals = (window.values[:, some] - np.clip(levels, 0, 255)) * used
    inverse = np.linalg.inv(known @ known.transpose(0, 2, 1) + 1e-3 * np.eye(parameters.shape[1])).astype(
        np.float32
    )

    def orthogonal(values: Array) -> Array:
        """Part of values at the pixels that is orthogonal to the disc's derivatives, shape (n, p)."""
        share = inverse @ (known @ values[:, :, None])
        return np.asarray(values - (share.transpose(0, 2, 1) @ known)[:, 0])

    shared = known @ tried.T
    squares = used.astype(np.float32) @ (tried * tried).T - (shared * (inverse @ shared)).sum(axis=1)
    residuals = orthogonal(residuals)
    unclipped = (used * ((window.values[:, some] < LIGHTEST) - CLIPPED)).astype(np.float32)
    shown = (unclipped @ tried.T > 0) | (parameters[:, [LIGHT]] < LIGHTEST)
    each = np.arange(len(residuals))
    edges, present = np.zeros((len(residuals), EDGES, EDGE)), np.zeros((len(residuals), EDGES), dtype=bool)
    for number in range(EDGES):
        overlap, length = (residuals @ tried.T) * shown, np.maximum(squares, 1.0)
        best = (overlap**2 / length).argmax(axis=1)
        lighter = overlap[each, best] / length[each, best]
        gain = lighter * overlap[each, best]
        present[:, number] = gain > GAIN * np.maximum(window.noise**2, QUANTISATION)
        edges[:, number] = np.stack([angles[best], offsets[best], lighter, np.zeros_like(lighter)], axis=1)
        chosen = orthogonal(tried[best] * used)
        residuals = residuals - lighter[:, None] * chosen
        squares = squares - (chosen @ tried.T) ** 2 / np.maximum((chosen**2).sum(axis=1, keepdims=True), 1.0)
    edges *= present[:, :, None]
    return np.concatenate([parameters, edges.reshape(len(residuals), -1)], axis=1), present

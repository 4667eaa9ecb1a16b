"""Straight edges beside a disc, such as those of the wall that it is printed on.

They are found by greedy orthogonal matching pursuit: of many half-planes, the one that reduces the residuals
of the disc model most, then a second; what the disc itself could explain by moving is projected out first.

Source: Y. C. Pati, R. Rezaiifar, P. S. Krishnaprasad, "Orthogonal matching pursuit", Asilomar Conference
1993. Units: pixels, grey levels.
"""

import numpy as np
from scipy.special import ndtr

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.vision.discs.disc_image_model import BLUR, EDGE, EDGES, LIGHT, RADIUS, Array, disc_image
from pinnray.vision.discs.pixel_windows import LIGHTEST, QUANTISATION, PixelWindows

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
    normal = known @ known.transpose(0, 2, 1) + 1e-3 * np.eye(parameters.shape[1])
    inverse = np.linalg.inv(normal).astype(np.float32)

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

"""Straight edges near a disc, such as those of the wall that it is printed on: which there are, and where.

A greedy search (matching pursuit): of many half-planes, the one that explains most of what the picture
without it leaves over, then a second. What the disc itself could explain by moving is taken out first.

Source: Y. C. Pati, R. Rezaiifar, P. S. Krishnaprasad, "Orthogonal matching pursuit", Asilomar Conference
1993.
"""

import numpy as np
from scipy.special import ndtr

from geometry.arrays import BoolArray, FloatArray
from vision.disc_model import BLUR, COUNT, EDGE, RADIUS, picture
from vision.disc_window import Window

EDGES = 2
"""At most, beside every disc."""

ANGLES = 32
OFFSETS = np.arange(0.75, 4.0, 0.5)
"""Of the half-planes that are tried: directions of the normal, and pixels between disc and edge."""

GAIN = 60.0
"""Squares that an edge must explain, over the variance of the noise."""


def with_edges(window: Window, parameters: FloatArray, trusted: BoolArray) -> tuple[FloatArray, BoolArray]:
    """Add the parameters of the edges.

    Args:
        window: The pixels around the discs.
        parameters: Of the discs alone, nearly right, shape (n, 10).
        trusted: Pixels that may be used, shape (n, p).

    Returns:
        Parameters with two edges, shape (n, 16), and which of the edges are there, shape (n, 2).
    """
    angles, gaps = (a.ravel() for a in np.meshgrid(np.arange(ANGLES) * 2 * np.pi / ANGLES, OFFSETS))
    offsets = gaps + np.median(parameters[:, RADIUS])
    across = np.cos(angles)[:, None] * window.x + np.sin(angles)[:, None] * window.y
    tried = ndtr((across - offsets[:, None]) / np.median(parameters[:, BLUR])).astype(np.float32)
    levels, known = picture(parameters.astype(np.float32), window.x, window.y)
    known = known * trusted[:, None]
    rest = (window.values - np.clip(levels, 0, 255)) * trusted
    squares = trusted @ (tried * tried).T
    result = np.zeros((len(parameters), COUNT + EDGE * EDGES))
    result[:, :COUNT] = parameters
    present = np.zeros((len(parameters), EDGES), dtype=bool)
    for number in range(EDGES):
        inverse = np.linalg.inv(known @ known.transpose(0, 2, 1) + np.eye(known.shape[1]) * 1e-3)
        rest = rest - ((inverse @ (known @ rest[:, :, None])).transpose(0, 2, 1) @ known)[:, 0]
        shared = known @ tried.T
        length = np.maximum(squares - (shared * (inverse @ shared)).sum(axis=1), 1.0)
        alike = rest @ tried.T
        best = (alike**2 / length).argmax(axis=1)
        each = np.arange(len(best))
        lighter = alike[each, best] / length[each, best]
        gain = lighter * alike[each, best]
        present[:, number] = gain > GAIN * np.maximum(window.noise**2, 1 / 12)
        result[:, COUNT + EDGE * number : COUNT + EDGE * (number + 1)] = np.stack(
            [angles[best], offsets[best], lighter], axis=1
        )
        known = np.concatenate([known, (tried[best] * trusted)[:, None]], axis=1)
    return result, present

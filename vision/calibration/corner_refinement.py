"""Corner refinement to hundredths of a pixel by a parametric fit to the grey levels around a corner.

    I(p) = L + A erf(n₁·(p - q) / s) erf(n₂·(p - q) / s)

is the picture of two edges with normals n₁ and n₂ that cross at q, blurred to the width s. It is symmetric
about q like the real one, so that the corner is unbiased even where the edges are not perpendicular and the
product is no exact blur. Units: pixels, grey levels.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from pinnray.runtime.arrays import FloatArray

STEPS = 12
START_WIDTH, WIDTHS = 1.2, (0.4, 6.0)
FARTHEST = 1.5
"""Largest distance from the guess, pixels; a quarter of the radius if that is more."""
LEAST_CONTRAST = 5.0
"""Smallest A of a corner, grey levels."""
TURN = 0.2
"""Longest step of an angle, rad."""


def refine_corners(
    grey: NDArray[np.uint8], guesses: FloatArray, edges: FloatArray, radii: FloatArray
) -> FloatArray:
    """Refine guesses that are off by a pixel or two, all at once, by the Gauss-Newton method.

    Args:
        grey: Shape (height, width).
        guesses: Shape (n, 2).
        edges: Directions of the two edges through each, in rows, shape (n, 2, 2).
        radii: Of the pixels that are used around each, shape (n,).

    Returns:
        Shape (n, 2); NaN where there is no such corner.
    """
    origins = np.rint(guesses).astype(np.int64)
    reach = int(np.ceil(radii.max()))
    y, x = (grid.ravel().astype(np.float64) for grid in np.mgrid[-reach : reach + 1, -reach : reach + 1])
    rows, columns = origins[:, 1:] + y.astype(np.int64), origins[:, :1] + x.astype(np.int64)
    height, width = grey.shape
    used = (np.hypot(x, y) <= radii[:, None]) & (rows >= 0) & (rows < height) & (columns >= 0)
    used &= columns < width
    values = grey[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)].astype(np.float64)

    level = np.sum(values * used, axis=1) / np.maximum(used.sum(axis=1), 1)
    angles = np.arctan2(edges[:, :, 1], edges[:, :, 0])
    one = np.ones(len(guesses))
    parameters = np.stack([level, one, *(guesses - origins).T, *angles.T, START_WIDTH * one], axis=1)
    shape, _ = _picture(parameters, x, y)
    shape = (shape - level[:, None]) * used
    parameters[:, 1] = np.sum(shape * values, axis=1) / np.maximum(np.sum(shape**2, axis=1), 1e-9)
    limits = np.array([255, 255, 0.5, 0.5, TURN, TURN, 0.5])
    for _ in range(STEPS):
        levels, derivatives = _picture(parameters, x, y)
        weighted = derivatives * used[:, None]
        normal = weighted @ derivatives.transpose(0, 2, 1) + 1e-6 * np.eye(7)
        slope = weighted @ (values - levels)[:, :, None]
        parameters += np.clip(np.linalg.solve(normal, slope)[:, :, 0], -limits, limits)
        parameters[:, 6] = np.clip(parameters[:, 6], *WIDTHS)
    corners = parameters[:, 2:4] + origins
    near = np.linalg.norm(corners - guesses, axis=1) <= np.maximum(FARTHEST, radii / 4)
    found = near & (np.abs(parameters[:, 1]) >= LEAST_CONTRAST)
    return np.where(found[:, None], corners, np.nan)


def _picture(parameters: FloatArray, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Grey levels I, shape (n, p), and their derivatives by L, A, q, both angles and s, (n, 7, p)."""
    level, contrast, qx, qy, first, second, width = parameters.T[:, :, None]
    dx, dy = x - qx, y - qy
    across = [(np.cos(angle) * dy - np.sin(angle) * dx) / width for angle in (first, second)]
    along = [(np.cos(angle) * dx + np.sin(angle) * dy) / width for angle in (first, second)]
    steps = [erf(distance) for distance in across]
    slopes = [2 / np.sqrt(np.pi) * np.exp(-(distance**2)) for distance in across]
    one = contrast * slopes[0] * steps[1]
    two = contrast * slopes[1] * steps[0]
    derivatives = [
        np.ones_like(one),
        steps[0] * steps[1],
        (one * np.sin(first) + two * np.sin(second)) / width,
        -(one * np.cos(first) + two * np.cos(second)) / width,
        -one * along[0],
        -two * along[1],
        -(one * across[0] + two * across[1]) / width,
    ]
    return level + contrast * steps[0] * steps[1], np.stack(derivatives, axis=1)

"""Model of the grey levels near the edge of a disc, with its derivatives by the parameters.

    I(p) = (1 + g·(p - p₀)) (L - A Φ((R(φ) - √(ρ² + s²)) / s) + Σ B Φ((n·(p - p₀) - h) / s))

Here ρ and φ are the distance and the direction of the pixel p from the centre; R(φ) is an ellipse; Φ is the
normal distribution, s the width of the edge, L the level around the disc, L - A the level within and g the
gradient of the light about the fixed point p₀. The square root is the mean distance to the centre of a point
that is blurred by s: it accounts for the curvature of the edge, which shrinks a blurred disc by s²/2R. The
sum is over straight edges beside the disc, such as those of the wall that it is printed on, with normals n,
offsets h and levels L + B beyond.

Many discs at once, in single precision. Units: pixels, grey levels.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

Array = NDArray[np.float32]

X, Y, RADIUS, STRETCH, SLANT, BLUR, LIGHT, CONTRAST, SHADE_X, SHADE_Y = range(10)
"""Columns of the parameters. Stretch and slant make the ellipse: its R(φ) = R (√(1 + a² + b²) - a cos 2φ - b
sin 2φ)^-½ has semi-axes R e^(±ε), where sinh 2ε is the length of (a, b)."""
COUNT = 10
"""Parameters of a disc."""
EDGE = 3
"""Parameters of a straight edge: angle of its normal, offset of the edge along that from p₀, and how much
lighter it is beyond."""
EDGES = 2
"""Straight edges of every disc; those that are absent have zero contrast."""
WIDTH = COUNT + EDGES * EDGE
"""All parameters."""


def disc_image(parameters: Array, x: Array, y: Array) -> tuple[Array, Array]:
    """Grey levels and their derivatives.

    Args:
        parameters: Those of the disc, the centre relative to p₀, then those of its straight edges; shape
            (n, m) with m = 10 + 3 for each straight edge.
        x: Pixels relative to p₀, to the right, shape (p,).
        y: Likewise, down.

    Returns:
        Levels, shape (n, p), and derivatives by the parameters, shape (n, m, p).
    """
    columns = np.ascontiguousarray(parameters.T)[:, :, None]
    cx, cy, radius, a, b, s, light, contrast, gx, gy = columns[:COUNT]
    dx, dy = x - cx, y - cy
    square = dx * dx + dy * dy + np.float32(1e-6)
    twice_cosine, twice_sine = (dx * dx - dy * dy) / square, 2 * dx * dy / square
    length = np.sqrt(1 + a * a + b * b)
    shape = 1 / np.sqrt(length - a * twice_cosine - b * twice_sine)
    distance = np.sqrt(square + s * s)
    z = (radius * shape - distance) / s
    covered, density = _blurred_step(z)
    shade = 1 + gx * x + gy * y
    reflectance = light - contrast * covered

    derivatives = np.empty((len(z), len(columns), z.shape[1]), dtype=np.float32)
    by_edge = density * shade * (-contrast / s)
    by_shape = radius * shape**3 / 2 * by_edge
    turning = 2 * (a * twice_sine - b * twice_cosine) / square * by_shape  # of R(φ) by φ, over ρ²
    radial = by_edge / distance
    derivatives[:, X] = radial * dx - turning * dy
    derivatives[:, Y] = radial * dy + turning * dx
    derivatives[:, RADIUS] = shape * by_edge
    derivatives[:, STRETCH] = (twice_cosine - a / length) * by_shape
    derivatives[:, SLANT] = (twice_sine - b / length) * by_shape
    derivatives[:, BLUR] = -(s / distance + z) * by_edge
    derivatives[:, LIGHT] = shade
    derivatives[:, CONTRAST] = -shade * covered
    for first in range(COUNT, len(columns), EDGE):
        angle, offset, lighter = columns[first : first + EDGE]
        cosine, sine = np.cos(angle), np.sin(angle)
        z = (cosine * x + sine * y - offset) / s
        beyond, density = _blurred_step(z)
        reflectance += lighter * beyond
        by_edge = density * shade * (lighter / s)
        derivatives[:, first] = by_edge * (cosine * y - sine * x)
        derivatives[:, first + 1] = -by_edge
        derivatives[:, first + 2] = shade * beyond
        derivatives[:, BLUR] -= z * by_edge
    derivatives[:, SHADE_X] = reflectance * x
    derivatives[:, SHADE_Y] = reflectance * y
    return shade * reflectance, derivatives


def _blurred_step(z: Array) -> tuple[Array, Array]:
    """The normal distribution and its density."""
    covered = (1 + erf(np.float32(np.sqrt(0.5)) * z)) / 2
    return covered, np.float32(1 / np.sqrt(2 * np.pi)) * np.exp(-z * z / 2)

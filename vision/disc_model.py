"""The picture of a disc: what every pixel near its edge shows, and how that changes with the parameters.

    I(p) = (1 + g·(p - p₀)) (L - A Φ((R(φ) - √(ρ² + s²)) / s))

Here ρ and φ are the distance and the direction of the pixel p from the centre; R(φ) is an ellipse; Φ is the
normal distribution, s the width of the edge, L the level around the disc, L - A the level within and g the
gradient of the light about the fixed point p₀. The square root is the mean distance to the centre of a point
that is blurred by s: it accounts for the curvature of the edge, which shrinks a blurred disc by s²/2R.

Many discs at once, in single precision. Units: pixels, grey levels.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

Array = NDArray[np.float32]

X, Y, RADIUS, STRETCH, SLANT, BLUR, LIGHT, CONTRAST, SHADE_X, SHADE_Y = range(10)
"""Places of the parameters. Stretch and slant make the ellipse: its R(φ) = R (√(1 + a² + b²) - a cos 2φ - b
sin 2φ)^-½ has semi-axes R e^(±ε), where sinh 2ε is the length of (a, b)."""

COUNT = 10


def picture(parameters: Array, x: Array, y: Array) -> tuple[Array, Array]:
    """Grey levels and their derivatives.

    Args:
        parameters: Shape (n, 10), in the order above; the centre is relative to p₀.
        x: Pixels relative to p₀, to the right, shape (p,).
        y: Likewise, down.

    Returns:
        Levels, shape (n, p), and derivatives by the parameters, shape (n, 10, p).
    """
    cx, cy, radius, a, b, s, light, contrast, gx, gy = np.ascontiguousarray(parameters.T)[:, :, None]
    dx, dy = x - cx, y - cy
    square = dx * dx + dy * dy + np.float32(1e-6)
    twice_cosine, twice_sine = (dx * dx - dy * dy) / square, 2 * dx * dy / square
    length = np.sqrt(1 + a * a + b * b)
    shape = 1 / np.sqrt(length - a * twice_cosine - b * twice_sine)
    distance = np.sqrt(square + s * s)
    z = (radius * shape - distance) / s
    covered = (1 + erf(np.float32(np.sqrt(0.5)) * z)) / 2
    shade = 1 + gx * x + gy * y
    reflectance = light - contrast * covered

    derivatives = np.empty((*z.shape[:1], COUNT, z.shape[1]), dtype=np.float32)
    by_z = np.float32(-1 / np.sqrt(2 * np.pi)) * np.exp(-z * z / 2) * shade * contrast
    by_edge = by_z / s
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
    derivatives[:, SHADE_X] = reflectance * x
    derivatives[:, SHADE_Y] = reflectance * y
    return shade * reflectance, derivatives

"""Model of the grey levels near the edge of a disc, with its derivatives by the parameters.

    I(p) = (1 + g·q) (L - A Φ((R(φ) - √(ρ² + s²)) / s) + Σ B Φ((n·q - h - c (t·q)²/2) / s)),  q = p - p₀

Here ρ and φ are the distance and the direction of the pixel p from the centre; R(φ) is an ellipse, which
waves cos kφ and sin kφ, relative to its radius, may turn into an irregular outline; Φ is the
normal distribution, s the width of the edge, L the level around the disc, L - A the level within and g the
gradient of the light about the fixed point p₀. The square root is the mean distance to the centre of a point
that is blurred by s: it accounts for the curvature of the edge, which shrinks a blurred disc by s²/2R. The
sum is over edges beside the disc, such as those of the wall that it is printed on, with normals n, tangents
t, offsets h, curvatures c and levels L + B beyond.

Many discs at once, in single precision. Units: pixels, grey levels.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from pinnray.runtime.arrays import FloatArray

Array = NDArray[np.float32]

X, Y, RADIUS, STRETCH, SLANT, BLUR, LIGHT, CONTRAST, SHADE_X, SHADE_Y = range(10)
"""Columns of the parameters. Stretch and slant make the ellipse: its R(φ) = R (√(1 + a² + b²) - a cos 2φ - b
sin 2φ)^-½ has semi-axes R e^(±ε), where sinh 2ε is the length of (a, b)."""
COUNT = 10
"""Parameters of a disc."""
LOBES = range(3, 10)
"""Waves of an irregular outline; those with one and two lobes are the place and the ellipse."""
OUTLINE = 2 * len(LOBES) + 1
"""Parameters of a printed dot: heights of cosine and sine of every wave over the radius, and the halo
of a sharpened edge, over the contrast."""
HALO = COUNT + 2 * len(LOBES)
"""Column of the halo: Φ(z) becomes Φ(z) + κ (Φ(z) - Φ(z / `WIDER`)), as by an unsharp mask."""
WIDER = 1.6
"""Width of the halo over that of the edge; 1.5 for an edge of 0.85 pixels and a mask of 1 pixel."""
EDGE = 4
"""Parameters of an edge beside the disc: angle of its normal, offset of the edge along that from p₀, how much
lighter it is beyond, and curvature, positive if the edge bends along its normal."""
EDGES = 2
"""Edges beside every disc; those that are absent have zero contrast."""
DIRECTIONS = np.arange(128) * 2 * np.pi / 128
"""Directions in which an outline is evaluated, rad."""
WIDTH = COUNT + EDGES * EDGE
"""All parameters of a fit that is reported."""


def disc_image(parameters: Array, x: Array, y: Array) -> tuple[Array, Array]:
    """Grey levels and their derivatives.

    Args:
        parameters: Those of the disc, the centre relative to p₀, those of an irregular outline or none, then
            those of the edges beside it; shape (n, m) with m = 10 (+ 15) + 4 for each of these.
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
    ellipse = 1 / np.sqrt(length - a * twice_cosine - b * twice_sine)
    waves, first_edge = irregular_columns(parameters.shape[1])
    cosines, sines = _multiples(dx, dy, square) if len(waves) else (np.empty(0), np.empty(0))
    heights = columns[waves]
    wave = np.float32(1)
    slope = np.float32(0)
    for lobe, even, odd, cosine, sine in zip(
        LOBES, heights[::2], heights[1::2], cosines, sines, strict=False
    ):
        wave = wave + even * cosine + odd * sine
        slope = slope + lobe * (odd * cosine - even * sine)
    shape = ellipse * wave
    distance = np.sqrt(square + s * s)
    steep = np.sqrt(1 + (slope / wave) ** 2)  # the blur along ρ, where the outline is not across it
    z = (radius * shape - distance) / (s * steep)
    covered, density = _blurred_step(z)
    if len(waves):
        halo, wide, wide_density = columns[HALO], *_blurred_step(z / np.float32(WIDER))
        wide = covered - wide
        covered = covered + halo * wide
        density = (1 + halo) * density - halo / np.float32(WIDER) * wide_density
    shade = 1 + gx * x + gy * y
    reflectance = light - contrast * covered

    derivatives = np.empty((len(z), len(columns), z.shape[1]), dtype=np.float32)
    by_edge = density * shade * (-contrast / (s * steep))
    by_shape = radius * ellipse**2 * shape / 2 * by_edge
    turning = 2 * (a * twice_sine - b * twice_cosine) / square * by_shape  # of R(φ) by φ, over ρ²
    turning = turning - radius * ellipse * slope / square * by_edge
    radial = by_edge / distance
    derivatives[:, X] = radial * dx - turning * dy
    derivatives[:, Y] = radial * dy + turning * dx
    derivatives[:, RADIUS] = shape * by_edge
    derivatives[:, STRETCH] = (twice_cosine - a / length) * by_shape
    derivatives[:, SLANT] = (twice_sine - b / length) * by_shape
    derivatives[:, BLUR] = -(s / distance + z * steep) * by_edge
    derivatives[:, LIGHT] = shade
    derivatives[:, CONTRAST] = -shade * covered
    by_wave = radius * ellipse * by_edge if len(waves) else by_edge
    for number, (cosine, sine) in enumerate(zip(cosines, sines, strict=True)):
        derivatives[:, COUNT + 2 * number] = by_wave * cosine
        derivatives[:, COUNT + 2 * number + 1] = by_wave * sine
    if len(waves):
        derivatives[:, HALO] = -shade * contrast * wide
    for first in range(first_edge, len(columns), EDGE):
        angle, offset, lighter, curvature = columns[first : first + EDGE]
        cosine, sine = np.cos(angle), np.sin(angle)
        across, along = cosine * x + sine * y, cosine * y - sine * x
        z = (across - offset - curvature * along**2 / 2) / s
        beyond, density = _blurred_step(z)
        reflectance += lighter * beyond
        by_edge = density * shade * (lighter / s)
        derivatives[:, first] = by_edge * along * (1 + curvature * across)
        derivatives[:, first + 1] = -by_edge
        derivatives[:, first + 2] = shade * beyond
        derivatives[:, first + 3] = -by_edge * along**2 / 2
        derivatives[:, BLUR] -= z * by_edge
    derivatives[:, SHADE_X] = reflectance * x
    derivatives[:, SHADE_Y] = reflectance * y
    return shade * reflectance, derivatives


def irregular_columns(width: int) -> tuple[range, int]:
    """Columns of an irregular outline among those of `width` parameters, and the first of an edge."""
    end = COUNT + OUTLINE if width >= COUNT + OUTLINE else COUNT
    return range(COUNT, end), end


def outline(parameters: FloatArray) -> FloatArray:
    """Irregular outlines over their ellipses, 1 on the average, at `DIRECTIONS`, shape (n, 128)."""
    turns = np.outer(LOBES, DIRECTIONS)
    even, odd = _heights(parameters)
    return np.asarray(1 + even @ np.cos(turns) + odd @ np.sin(turns))


def _heights(parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Heights of the cosines and sines of an irregular outline, each of shape (n, lobes)."""
    return parameters[:, COUNT:HALO:2], parameters[:, COUNT + 1 : HALO : 2]


def outline_centroid(parameters: FloatArray) -> FloatArray:
    """Centroid of the darkness of irregular discs relative to their centres, shape (n, 2), pixels.

    Blur keeps the centroid of the darkness, though not the outline. With t² = ρ² + s² and an edge of the
    width w along ρ, which is above s where the outline is not across ρ, the darkness Φ((R - t) / w) has the
    area R²/2 + (w² - s²)/2 and the moment R³/3 + R (w² - s²/2) per angle, but for terms of order s⁴/R.

    Args:
        parameters: As for `disc_image`, with an irregular outline, shape (n, m).
    """
    radius, a, b, blur = parameters[:, [RADIUS, STRETCH, SLANT, BLUR]].T[:, :, None]
    even, odd = _heights(parameters)
    turns, twice = np.outer(LOBES, DIRECTIONS), 2 * DIRECTIONS
    wave = outline(parameters)
    slope = (odd * LOBES) @ np.cos(turns) - (even * LOBES) @ np.sin(turns)
    reach = radius * wave / np.sqrt(np.sqrt(1 + a**2 + b**2) - a * np.cos(twice) - b * np.sin(twice))
    steep = (1 + (slope / wave) ** 2) * (1 - (WIDER**2 - 1) * parameters[:, [HALO]])  # by a halo's variance
    moments = reach**3 / 3 + reach * blur**2 * (steep - 0.5)
    areas = reach**2 / 2 + blur**2 * (steep - 1) / 2
    arms = np.column_stack([np.cos(DIRECTIONS), np.sin(DIRECTIONS)])
    return np.asarray(moments @ arms / areas.sum(axis=1, keepdims=True))


def _multiples(dx: Array, dy: Array, square: Array) -> tuple[list[Array], list[Array]]:
    """Cosines and sines of the multiples of a direction by the lobes, each of shape (n, p)."""
    step = (dx + 1j * dy) / np.sqrt(square)
    power = step ** (LOBES[0] - 1)
    cosines, sines = [], []
    for _ in LOBES:
        power = power * step
        cosines.append(power.real)
        sines.append(power.imag)
    return cosines, sines


def _blurred_step(z: Array) -> tuple[Array, Array]:
    """The normal distribution and its density."""
    covered = (1 + erf(np.float32(np.sqrt(0.5)) * z)) / 2
    return covered, np.float32(1 / np.sqrt(2 * np.pi)) * np.exp(-z * z / 2)

"""Waves of brightness on the ground around a disc, such as the layers of a print, found and taken out.

A wave is sought where the ground alone is seen, as the highest peak of a periodogram, and refined by
Gauss-Newton. At the edge of the disc it is cut off before the lens blurs it. Units: pixels, grey levels.

Source: M. B. Priestley, Spectral Analysis and Time Series, Academic Press 1981, section 6.1 (periodogram as
least squares for one frequency); R. A. Fisher, "Tests of significance in harmonic analysis", Proceedings of
the Royal Society A 125, 1929 (peak over the sum as the measure).
"""

from dataclasses import replace

import numpy as np
from scipy.special import erfc, ndtri

from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray
from pinnray.vision.discs.disc_image_model import (
    BLUR,
    CONTRAST,
    COUNT,
    EDGE,
    EDGES,
    LIGHT,
    SHADE_X,
    SHADE_Y,
    Array,
    X,
    Y,
    disc_image,
)
from pinnray.vision.discs.pixel_windows import (
    DARKEST,
    LIGHTEST,
    QUANTISATION,
    SCALE,
    PixelWindows,
    median_where,
)

SHARE = 0.2
"""Share of the variance of the ground that a wave must explain; the highest of white noise explains 0.15."""
PEAK = 0.5
"""Least part of that share by the peak's own grid point, which has two thirds where the wave lies between."""
FEWEST = 60
"""Fewest pixels of the ground in which a wave is sought."""
AWAY = 1.5
"""Distance of the ground from the edge, pixels, beyond its blur."""
BORDER = 0.25
"""Relative contrast from which on a straight edge ends the ground."""
PERIODS = 2.0
"""Fewest periods of a wave within the window; with fewer it could be a glare."""
UNLIKE = 0.4
"""Largest deviation from 1 of the product of a wave's heights in opposite halves of the ground, over its
squared height: what a joint of walls leaves is in one half alone."""
REFINEMENTS = 3
"""Steps of Gauss-Newton for the wave vector."""
LONGEST_STEP = 0.5
"""Largest change of the phase at the rim of the window in a step, rad."""
PASSES = 3
"""Times that the distance from the edge is taken from grey levels, each time with less of the wave."""
SURE, FAR = 0.01, 6.0
"""Share of the ground in a pixel, or of the disc, that counts as none, and the distance from the edge there
over its width."""
FINEST = 2.5
"""Largest wave number times width of the edge: the lens hides finer waves, whose cut would be all noise."""


def without_waves(window: PixelWindows, parameters: FloatArray) -> tuple[PixelWindows, IntArray]:
    """Take the strongest wave out of the grounds that have one.

    Args:
        window: The pixels around the discs.
        parameters: Of the discs, near the solution, shape (n, m) with straight edges.

    Returns:
        The pixels without waves of the discs that had one, and the numbers of these discs, shape (k,).
    """
    levels, _ = disc_image(parameters.astype(np.float32), window.x, window.y)
    ground = window.within & (window.outside(parameters) > AWAY + parameters[:, [BLUR]])
    ground &= (window.values > DARKEST) & (window.values < LIGHTEST) & (_beyond(window, parameters) < 0.1)
    count = np.maximum(ground.sum(axis=1), 1)
    residuals = _without_parts((window.values - levels) * ground, _smooth_light(window) * ground[:, None])
    vectors, peaks = _strongest(window, residuals)
    power = (residuals**2).sum(axis=1) / count
    enough = (count > FEWEST) & (np.abs(parameters[:, CONTRAST]) > 1)
    (likely,) = np.nonzero(enough & (2 * peaks / count**2 > PEAK * SHARE * power))
    window, now, ground, power = window.at(likely), parameters[likely], ground[likely], power[likely]
    heights, vectors, left = _fitted(window, ground, residuals[likely], vectors[likely])
    explained = power - (left**2).sum(axis=1) / count[likely]
    explained *= _throughout(window, ground, residuals[likely], heights, vectors)
    (found,) = np.nonzero(explained > np.maximum(SHARE * power, QUANTISATION))
    some, now, heights, vectors = window.at(found), now[found], heights[found], vectors[found]
    if not len(found):
        return some, likely[found]
    values = some.values
    for _ in range(PASSES):
        values = some.values - _shown(some, now, values, heights, vectors)
    noise = SCALE * median_where(np.abs(left[found]), ground[found])
    return replace(some, values=values, noise=np.minimum(some.noise, noise)), likely[found]


def _shown(
    window: PixelWindows, parameters: FloatArray, smooth: Array, heights: FloatArray, vectors: FloatArray
) -> Array:
    """Wave in the pixels, shape (n, p): that of the ground, cut off at the disc and then blurred.

    At the distance d beyond a straight edge with the normal n, a wave exp(i k·p) of the ground is, after a
    blur by s, exp(i k·p - k² s²/2) Φ(d/s + i s k·n), with the normal distribution Φ; far from the edge
    that is the height that was fitted. Where a share of the ground shows, d/s is the share's quantile.

    Args:
        window: The pixels.
        parameters: Of the discs, shape (n, m).
        smooth: Grey levels with little of the wave, shape (n, p).
        heights: Of cosine and sine, far from the edge, shape (n, 2), grey levels.
        vectors: Shape (n, 2), rad/pixel.
    """
    x, y, blur, light, contrast, shade_x, shade_y = parameters[
        :, [X, Y, BLUR, LIGHT, CONTRAST, SHADE_X, SHADE_Y]
    ].T[:, :, None]
    share = (smooth / (1 + shade_x * window.x + shade_y * window.y) - light + contrast) / contrast
    outside = ndtri(np.clip(share, SURE, 1 - SURE))
    outside = np.where(np.abs(share - 0.5) < 0.5 - SURE, outside, np.copysign(FAR, share - 0.5))
    dx, dy = window.x - x, window.y - y
    across = (vectors[:, [0]] * dx + vectors[:, [1]] * dy) / np.maximum(np.hypot(dx, dy), 0.5)
    across = np.clip(across * blur, -FINEST, FINEST)
    phase = vectors[:, [0]] * window.x + vectors[:, [1]] * window.y
    wave = (heights[:, [0]] - 1j * heights[:, [1]]) * np.exp(1j * phase)
    cut = erfc(-(outside + 1j * across) / np.sqrt(2)) / 2
    return np.asarray((wave * cut).real * (1 - _beyond(window, parameters)), dtype=np.float32)


def _beyond(window: PixelWindows, parameters: FloatArray) -> Array:
    """Share of the pixels beyond straight edges where the ground ends, shape (n, p)."""
    within = np.ones((len(parameters), len(window.x)), dtype=np.float32)
    for first in range(COUNT, COUNT + EDGES * EDGE, EDGE):
        angle, offset, lighter, curvature = parameters[:, first : first + EDGE].T[:, :, None]
        cosine, sine = np.cos(angle), np.sin(angle)
        along = cosine * window.y - sine * window.x
        away = cosine * window.x + sine * window.y - offset - curvature * along**2 / 2
        ends = np.abs(lighter) > BORDER * np.abs(parameters[:, [CONTRAST]])
        within *= np.where(ends, np.clip(0.5 - away / (2 * parameters[:, [BLUR]]), 0, 1), 1)
    return np.asarray(1 - within, dtype=np.float32)


def _strongest(window: PixelWindows, residuals: Array) -> tuple[FloatArray, FloatArray]:
    """Wave vectors of the highest peaks of periodograms, shape (n, 2), rad/pixel, and their squared sums."""
    side = len(window.ring)
    size = 2 * side
    tiles = np.zeros((len(residuals), side, side), dtype=np.float32)
    tiles[:, window.ring] = residuals
    power = np.abs(np.fft.rfft2(tiles, (size, size))) ** 2
    power *= np.hypot(np.fft.rfftfreq(size), np.fft.fftfreq(size)[:, None]) > PERIODS / side
    best = power.reshape(len(tiles), -1).argmax(axis=1)
    row, column = np.divmod(best, power.shape[2])
    vectors = 2 * np.pi * np.column_stack([np.fft.rfftfreq(size)[column], np.fft.fftfreq(size)[row]])
    return vectors, power[np.arange(len(tiles)), row, column]


def _fitted(
    window: PixelWindows, ground: BoolArray, residuals: Array, vectors: FloatArray
) -> tuple[FloatArray, FloatArray, Array]:
    """Heights of cosine and sine, wave vectors, each of shape (n, 2), and what is left of the residuals."""
    longest = LONGEST_STEP / (len(window.ring) / 2)
    vectors = vectors.copy()
    for number in range(REFINEMENTS + 1):
        columns = _wave_and_light(window, vectors) * ground[:, None]
        heights = _least_squares(columns, residuals)
        left = residuals - (heights[:, None] @ columns)[:, 0]
        if number == REFINEMENTS:
            break
        turned = (heights[:, [1]] * columns[:, 0] - heights[:, [0]] * columns[:, 1])[:, None]
        by_vector = np.concatenate([turned * window.x, turned * window.y], axis=1)
        columns = np.concatenate([columns, by_vector], axis=1)
        steps = _least_squares(columns, left)[:, -2:]
        vectors += np.clip(steps, -longest, longest)
    return heights[:, :2], vectors, left.astype(np.float32)


def _throughout(
    window: PixelWindows, ground: BoolArray, residuals: Array, heights: FloatArray, vectors: FloatArray
) -> BoolArray:
    """Whether waves are alike in opposite halves of the ground, along the wave and across it, shape (n,)."""
    columns = _wave_and_light(window, vectors)
    along = vectors[:, [0]] * window.x + vectors[:, [1]] * window.y
    across = vectors[:, [0]] * window.y - vectors[:, [1]] * window.x
    alike = np.ones(len(vectors), dtype=bool)
    for place in (along, across):
        first = place < median_where(place, ground)[:, None]
        one, other = (
            _least_squares(columns * half[:, None], residuals * half)[:, :2]
            for half in (ground & first, ground & ~first)
        )
        product, square = (one * other).sum(axis=1), (heights[:, :2] ** 2).sum(axis=1)
        alike &= np.abs(product - square) < UNLIKE * square
    return alike


def _wave_and_light(window: PixelWindows, vectors: FloatArray) -> FloatArray:
    """Cosine and sine of waves, and terms of light that varies slowly, at the pixels, shape (n, 8, p)."""
    phase = vectors[:, [0]] * window.x + vectors[:, [1]] * window.y
    smooth = np.broadcast_to(_smooth_light(window), (len(vectors), 6, len(window.x)))
    return np.concatenate([np.stack([np.cos(phase), np.sin(phase)], axis=1), smooth], axis=1)


def _smooth_light(window: PixelWindows) -> FloatArray:
    """Terms of light that varies slowly, such as a glare, at the pixels, shape (6, p)."""
    x, y = 2 * window.x / len(window.ring), 2 * window.y / len(window.ring)
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y])


def _without_parts(values: Array, columns: FloatArray) -> Array:
    """Values, shape (n, p), without their part in columns, shape (n, c, p)."""
    return np.asarray(values - (_least_squares(columns, values)[:, None] @ columns)[:, 0], np.float32)


def _least_squares(columns: FloatArray, values: Array) -> FloatArray:
    """Coefficients of columns, shape (n, c, p), for values, shape (n, p)."""
    normal = columns @ columns.transpose(0, 2, 1)
    normal += 1e-6 * np.eye(columns.shape[1])
    return np.asarray(np.linalg.solve(normal, columns @ values[:, :, None])[:, :, 0])

"""Discs on a strip, drawn analytically: blurred edges, uneven light, noise."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import erf


class Dots(NamedTuple):
    """An image, uint8, and x, y, radius of its discs, shape (n, 3), pixels."""

    image: np.ndarray
    discs: np.ndarray


def step(distance: np.ndarray, blur: float) -> np.ndarray:
    """1 well within an edge, 0 well outside, for signed distances from it, pixels, positive inside."""
    return 0.5 * (1 + erf(distance / (np.sqrt(2) * np.hypot(blur, 0.3))))


def draw_disc(canvas: np.ndarray, disc: np.ndarray, colour: ArrayLike, blur: float) -> None:
    """Paint a disc onto a canvas of floats, shape (h, w, 3)."""
    x, y, radius = disc
    reach = radius + 5 * blur + 2
    left, top = max(int(x - reach), 0), max(int(y - reach), 0)
    part = canvas[top : int(y + reach) + 1, left : int(x + reach) + 1]
    rows, columns = np.ogrid[: part.shape[0], : part.shape[1]]
    share = step(radius - np.hypot(columns + left - x, rows + top - y), blur)[:, :, None]
    part += share * (np.asarray(colour, dtype=float) - part)


def exposed(canvas: np.ndarray, *, shading: float, noise: float, seed: int) -> np.ndarray:
    """`canvas` in a light that falls by `shading` from corner to corner, with normal noise; uint8."""
    height, width = canvas.shape[:2]
    rows, columns = np.ogrid[:height, :width]
    light = 1 + shading * (0.5 - (rows / height + columns / width) / 2)
    rng = np.random.default_rng(seed)
    noisy = canvas * light[:, :, None] + noise * rng.standard_normal(canvas.shape)
    return np.rint(np.clip(noisy, 0, 255)).astype(np.uint8)


def dots(
    radius: float,
    *,
    size: tuple[int, int] = (1280, 720),
    colour: ArrayLike = (45, 45, 45),
    wall: float = 215.0,
    background: float = 150.0,
    blur: float = 1.5,
    shading: float = 0.3,
    noise: float = 6.0,
    seed: int = 0,
) -> Dots:
    """Nine discs on a bent, bright wall, of which a quarter of a radius is seen beside them; seven around it.

    The seven are dark, up to 2.5 times as large, at most 25 pixels; three walls more lead to the first one.
    """
    rng = np.random.default_rng(seed)
    width, height = size
    x, y = np.arange(width)[None, :], np.arange(height)[:, None]

    def middle(x: np.ndarray) -> np.ndarray:
        return height * (0.42 + 0.1 * (x / width) ** 2)

    canvas = np.full((height, width, 3), background)
    walls = [np.abs(y - middle(x))]
    walls += [
        np.where(y > middle(x), np.abs(0.94 * (x - share * width) + 0.34 * (y - middle(x))), np.inf)
        for share in (0.3, 0.5, 0.7)
    ]
    for distance in walls:
        share = step(1.25 * radius - distance, blur) * ((x > 0.08 * width) & (x < 0.92 * width))
        canvas += share[:, :, None] * (wall - canvas)
    at = np.linspace(0.15, 0.85, 9) * width + rng.uniform(-0.5, 0.5, 9)
    markers = np.column_stack([at, middle(at), np.full(9, radius)])
    places = [(0.05, 0.1), (0.25, 0.1), (0.65, 0.1), (0.95, 0.1), (0.05, 0.9), (0.4, 0.9), (0.95, 0.9)]
    fiducials = np.column_stack(
        [np.array(places) * size + rng.uniform(-0.5, 0.5, (7, 2)), np.full(7, min(2.5 * radius, 25))]
    )
    for disc in markers:
        draw_disc(canvas, disc, colour, blur)
    for disc in fiducials:
        draw_disc(canvas, disc, (45, 45, 45), blur)
    return Dots(exposed(canvas, shading=shading, noise=noise, seed=seed), np.vstack([markers, fiducials]))

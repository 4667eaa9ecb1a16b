"""Pixels around discs of one size, gathered for all of them at once."""

from dataclasses import dataclass, replace
from typing import Self

import cv2
import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray
from pinnray.vision.discs.disc_image_model import RADIUS, Array, X, Y
from pinnray.vision.frames.frame import GreyImage

QUANTISATION = 1 / 12
"""Variance of rounding to grey levels, the smallest possible variance of the noise."""
DARKEST, LIGHTEST = 5, 250
"""Grey levels beyond which pixels may be clipped."""
INSIDE = 2.0
"""Distance from the edge inside a disc from which on its pixels show the noise alone, pixels."""
SCALE = 1.4826
"""Standard deviation over median absolute value, of normal noise."""


@dataclass(frozen=True)
class PixelWindows:
    """The pixels around some discs.

    Attributes:
        origins: Pixels in the middle of the windows, shape (n, 2).
        x, y: Pixels relative to the origins, shape (p,).
        values: Grey levels, shape (n, p).
        within: Whether the image has that pixel, shape (n, p).
        ring: Mask of these pixels in the squares around the discs, shape (s, s).
        noise: Standard deviation from the second differences along the rows, shape (n,), grey levels; edges
            in the window make it larger. On a clipped ground, of the discs' insides.
    """

    origins: IntArray
    x: Array
    y: Array
    values: Array
    within: BoolArray
    ring: BoolArray
    noise: FloatArray

    @classmethod
    def of(cls, grey: GreyImage, centres: FloatArray, inner: float, outer: float) -> Self:
        """Pixels at distances from `inner` to `outer` from the centres, shape (n, 2)."""
        origins = np.rint(centres).astype(np.int64)
        reach = int(np.ceil(outer))
        y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
        away = np.hypot(x, y)
        ring = (away >= inner) & (away <= outer)
        columns, rows = origins[:, 0, None, None] + x, origins[:, 1, None, None] + y
        height, width = grey.shape
        values = grey[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)].astype(np.float32)
        within = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
        second = np.abs(values[:, :, 2:] - 2 * values[:, :, 1:-1] + values[:, :, :-2])
        ground = (values >= LIGHTEST).mean(axis=(1, 2)) < 0.5  # a clipped one has no noise
        inside = away < (inner + outer) / 2 - INSIDE
        counted = within & (ground[:, None, None] | inside)
        noise = median_where(*(part.reshape(len(origins), -1) for part in (second, counted[:, :, 1:-1])))
        near_x, near_y = (each[ring].astype(np.float32) for each in (x, y))
        scatter = SCALE / 6**0.5 * noise
        return cls(origins, near_x, near_y, values[:, ring], within[:, ring], ring, scatter)

    def at(self, places: IntArray) -> "PixelWindows":
        """The pixels of some discs."""
        by_disc = ("origins", "values", "within", "noise")
        return replace(self, **{name: getattr(self, name)[places] for name in by_disc})

    def outside(self, parameters: FloatArray) -> FloatArray:
        """Distance of the pixels from the circles of discs, positive outside, shape (n, p)."""
        x, y, radius = parameters[:, [X, Y, RADIUS]].T[:, :, None]
        return np.asarray(np.hypot(self.x - x, self.y - y) - radius, dtype=np.float64)

    def smoothed(self, values: Array, size: int) -> Array:
        """Means over `size`² pixels, with zero outside the ring, shape (n, p)."""
        count, side = len(values), len(self.ring)
        tiles = np.zeros((count, side + size, side), dtype=np.float32)
        tiles[:, :side][:, self.ring] = values
        strip = cv2.blur(tiles.reshape(-1, side), (size, size), borderType=cv2.BORDER_CONSTANT)
        return np.asarray(strip.reshape(tiles.shape)[:, :side][:, self.ring], dtype=np.float32)


def median_where(values: Array, chosen: BoolArray) -> FloatArray:
    """The median of the chosen values of every row, shape (n,); zero where there is none."""
    ordered = np.sort(np.where(chosen, values, np.inf), axis=1)
    middle = np.take_along_axis(ordered, chosen.sum(axis=1, keepdims=True) // 2, axis=1)[:, 0]
    return np.where(chosen.any(axis=1), middle, 0.0).astype(np.float64)

"""Exact share of every pixel that a polygon covers.

An edge that rises by dy within a pixel adds dy to the coverage of the pixels to its right in that row, and to
its own pixel the part of dy to its right; cumulative sums along the rows give the area, without sampling.
Source: R. Levien, "Inside the fastest font renderer in the world", 2016.
"""

from typing import NamedTuple

import numpy as np

from geometry.arrays import FloatArray


class PixelCoverage(NamedTuple):
    """A part of the grid, and the share of every cell of it that is covered, shape (rows, columns)."""

    rows: slice
    columns: slice
    share: FloatArray


def pixel_coverage(edges: FloatArray, size: tuple[int, int]) -> PixelCoverage:
    """Share of every cell of a grid that closed polygons cover.

    Args:
        edges: Starts and ends, shape (n, 2, 2), in any order; cell (0, 0) goes from (0, 0) to (1, 1).
            The body lies on the same side of all, so holes run the other way round.
        size: Columns and rows of the grid.

    Returns:
        The coverage in the polygons' bounding box; elsewhere it is zero.
    """
    ends = edges.reshape(-1, 2)
    low = np.clip(np.floor(ends.min(axis=0, initial=np.inf)), 0, size).astype(np.int64)
    high = np.clip(np.ceil(ends.max(axis=0, initial=0)), low, size).astype(np.int64)
    (left, top), (width, height) = low, high - low
    start, end = _pieces(edges - low)
    middle, rise = (start + end) / 2, end[:, 1] - start[:, 1]
    column, row = np.floor(middle).astype(np.int64).T
    seen = (row >= 0) & (row < height) & (column < width)
    before = np.where(column < 0, 0.0, middle[:, 0] - column)[seen]
    place = (row * (width + 1) + np.maximum(column, 0))[seen]
    steps = np.zeros(height * (width + 1) + 1)
    steps += np.bincount(place, rise[seen] * (1 - before), minlength=len(steps))
    steps += np.bincount(place + 1, rise[seen] * before, minlength=len(steps))
    share = np.abs(np.cumsum(steps[:-1].reshape(height, width + 1), axis=1)[:, :width])
    return PixelCoverage(slice(top, top + height), slice(left, left + width), np.minimum(share, 1.0))


def _pieces(edges: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The edges cut where they cross from one cell to the next: starts and ends, shapes (m, 2)."""
    start, step = edges[:, 0], edges[:, 1] - edges[:, 0]
    every = np.arange(len(edges))
    edge, where = [every], [np.zeros(len(edges))]
    for axis in range(2):
        first = np.floor(edges[:, :, axis].min(axis=1)) + 1
        count = np.maximum(np.ceil(edges[:, :, axis].max(axis=1)) - first, 0).astype(np.int64)
        crossing = np.repeat(every, count)
        nth = np.arange(len(crossing)) - np.repeat(np.cumsum(count) - count, count)
        edge.append(crossing)
        where.append((first[crossing] + nth - start[crossing, axis]) / step[crossing, axis])
    owner, along = np.concatenate(edge), np.concatenate(where)
    order = np.lexsort((along, owner))
    owner, along = owner[order], along[order]
    cut = start[owner] + along[:, None] * step[owner]
    last = np.append(owner[1:] != owner[:-1], True)[: len(owner)]
    after = np.roll(cut, -1, axis=0)
    after[last] = edges[owner[last], 1]
    return cut, after

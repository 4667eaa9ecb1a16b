"""Layers of a print: stripes on a triangulated body, which move with it."""

from dataclasses import dataclass

import numpy as np

from pinnray.geometry.mesh.triangle_mesh import boundary_edges
from pinnray.runtime.arrays import FloatArray, IntArray

PERIOD = 0.4
"""Width of two layers, a lighter and a darker one, mm."""
DIRECTION = np.array([np.sqrt(0.5), np.sqrt(0.5)])
"""Unit vector across the layers."""


@dataclass(frozen=True, eq=False)
class PrintLayers:
    """Ends of the borders of every other layer, as shares of the edges of triangles.

    Attributes:
        nodes: Two nodes for each end, shape (k, 2, 2).
        along: Share of the way from the first to the second node, shape (k, 2).
    """

    nodes: IntArray
    along: FloatArray

    @classmethod
    def on(cls, points: FloatArray, triangles: IntArray) -> "PrintLayers":
        """The layers of a body at rest, from its nodes, shape (n, 2), mm, and triangles, shape (m, 3).

        The border of a layer consists of straight lines through the triangles and of pieces of the body's
        own border; the layer lies on the left of all.
        """
        height = points @ DIRECTION / (PERIOD / 2)  # layer k goes from k to k + 1; the even ones are meant
        inner, outer = _lines(height, triangles), _pieces(height, boundary_edges(triangles))
        return cls(*(np.concatenate(parts) for parts in zip(inner, outer, strict=True)))

    def edges(self, points: FloatArray) -> FloatArray:
        """The borders' edges, shape (k, 2, 2), with the nodes at points, shape (n, 2), mm."""
        start, end = points[self.nodes[:, :, 0]], points[self.nodes[:, :, 1]]
        return np.asarray(start + self.along[:, :, None] * (end - start))


def _lines(height: FloatArray, triangles: IntArray) -> tuple[IntArray, FloatArray]:
    """Lines between layers through triangles, from end to end, with the even layer on the left."""
    heights = height[triangles]
    first = np.ceil(heights.min(axis=1))
    count = np.maximum(np.ceil(heights.max(axis=1)) - first, 0).astype(np.int64)
    owner = np.repeat(np.arange(len(triangles)), count)
    level = first[owner] + np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)[owner]  # counter-clockwise
    below = height[sides] < level[:, None, None]
    # Counter-clockwise, the border rises through the level at the right end of the part above.
    ends = []
    for rises in (True, False):
        side = (below[:, :, 0] != below[:, :, 1]) & (below[:, :, 0] == rises)
        ends.append(sides[np.arange(len(owner)), side.argmax(axis=1)])
    falling, rising = ends[1], ends[0]
    lower = (level % 2 == 0)[:, None, None]  # an even layer begins: it lies above
    nodes = np.where(lower, np.stack([falling, rising], axis=1), np.stack([rising, falling], axis=1))
    ends_height = height[nodes]
    along = (level[:, None] - ends_height[:, :, 0]) / (ends_height[:, :, 1] - ends_height[:, :, 0])
    return nodes, along


def _pieces(height: FloatArray, border: IntArray) -> tuple[IntArray, FloatArray]:
    """Pieces of the body's border that belong to even layers."""
    start, end = height[border].T
    low, high = np.minimum(start, end), np.maximum(start, end)
    count = np.maximum(np.ceil(high) - np.floor(low), 1).astype(np.int64)
    owner = np.repeat(np.arange(len(border)), count)
    layer = np.floor(low)[owner] + np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    owner, layer = owner[layer % 2 == 0], layer[layer % 2 == 0]
    ends = np.clip(np.stack([layer, layer + 1], axis=1), low[owner, None], high[owner, None])
    ends = np.where((end >= start)[owner, None], ends, ends[:, ::-1])
    rise = (end - start)[owner, None]
    level = np.abs(rise) < 1e-12  # the whole of an edge along a layer
    along = np.where(level, [[0.0, 1.0]], (ends - start[owner, None]) / np.where(level, 1.0, rise))
    return np.repeat(border[owner][:, None], 2, axis=1), along

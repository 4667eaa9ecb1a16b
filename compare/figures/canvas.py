"""Triangles to pixels: each triangle in its number, in quarters of pixels, and colours given to the numbers.

A body that is drawn in many colours is rasterised once. Type, axes and legends are matplotlib's; both use the
same extent in mm, so that they fit to the pixel.
"""

from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from pinnray.geometry.mesh.boundary import edge_paths
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray, IntArray

Pixels = NDArray[np.uint8]


class Extent(NamedTuple):
    """A rectangle in the plane of the finger, mm."""

    left: float
    right: float
    bottom: float
    top: float

    @classmethod
    def around(cls, *clouds: FloatArray, margin: float) -> Self:
        """The rectangle around points, each of shape (n, 2), with a margin, mm."""
        points = np.concatenate(clouds)
        low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
        return cls(float(low[0]), float(high[0]), float(low[1]), float(high[1]))

    @property
    def width(self) -> float:
        """In mm, as the height."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """In mm."""
        return self.top - self.bottom


class Canvas:
    """A picture of a mesh that is coloured triangle by triangle, again and again.

    Attributes:
        extent: What the picture shows.
        outline: Numbers of the nodes along each line of the mesh's boundary.
    """

    def __init__(self, mesh: TriangleMesh, extent: Extent, *, width: int) -> None:
        """Show `extent` in a picture of `width` pixels, seen from the front."""
        self.extent, self.outline = extent, edge_paths(mesh.boundary_edges)
        self._mesh, self._size = mesh, (round(width * extent.height / extent.width), width)

    @cached_property
    def _at_rest(self) -> tuple[IntArray, IntArray]:
        return self._cover(self._mesh.points)

    def picture(self, colours: Pixels, points: FloatArray | None = None) -> Pixels:
        """Red, green, blue and opacity, shape (height, width, 4), of the mesh in colours.

        Args:
            colours: Red, green and blue of every triangle, shape (t, 3).
            points: Where the nodes are, shape (n, 2), mm, if not where the mesh has them.
        """
        pixels, quarters = self._at_rest if points is None else self._cover(points)
        opaque = np.zeros((len(colours) + 1, 4), dtype=np.uint16)
        opaque[:-1, :3], opaque[:-1, 3] = colours, 255
        packed = opaque.view(np.uint64).ravel()  # four numbers at a time: the sum of four bytes fits each
        sums = packed[quarters].sum(axis=0).view(np.uint16).reshape(-1, 4)
        image = np.zeros((*self._size, 4), dtype=np.uint8)
        seen = image.reshape(-1, 4)
        seen[pixels, :3] = sums[:, :3].astype(np.uint32) * 255 // sums[:, 3:]
        seen[pixels, 3] = sums[:, 3] // 4
        return image

    def _cover(self, points: FloatArray) -> tuple[IntArray, IntArray]:
        """The pixels that the mesh covers with its nodes at points of shape (n, 2), mm.

        Returns:
            Numbers of the pixels with any triangle, row by row, shape (k,), and the number of the triangle in
            each of their quarters, shape (4, k): the count of triangles where there is none.
        """
        (height, width), extent, count = self._size, self.extent, len(self._mesh.triangles)
        scale = 2 * width / extent.width
        places = (points - [extent.left, extent.top]) * [scale, -scale] - 0.5  # centres of quarters are whole
        places = np.clip(np.nan_to_num(places), -1e6, 1e6)  # of a result that went astray
        numbers = Image.new("I", (2 * width, 2 * height), count)
        draw = ImageDraw.Draw(numbers)
        for number, corners in enumerate(places[self._mesh.triangles].reshape(count, 6).tolist()):
            draw.polygon(corners, fill=number)
        quarters = np.asarray(numbers).reshape(height, 2, width, 2).transpose(1, 3, 0, 2).reshape(4, -1)
        pixels = np.flatnonzero((quarters < count).any(axis=0))
        return pixels, quarters[:, pixels].astype(np.int64)

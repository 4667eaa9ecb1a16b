"""Triangles to pixels: VTK off the screen, with a camera given exactly and no text.

VTK draws every triangle in its number, in quarters of pixels, and colours are given to the numbers: a body
that is drawn in many colours is rendered once. Type, axes and legends are matplotlib's; both use the same
extent in mm, so that they fit to the pixel.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
import pyvista
from numpy.typing import NDArray
from vtkmodules.vtkCommonCore import vtkLogger, vtkUnsignedCharArray
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow

# Draw without a display: VTK otherwise complains of a missing X server before it does so anyway.
os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  # how windows of `vtkRenderingCore` draw

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
    def _surface(self) -> Any:
        """The triangles, each in the colour of its number."""
        triangles = self._mesh.triangles
        faces = np.insert(triangles, 0, 3, axis=1)
        surface = pyvista.PolyData(np.pad(self._mesh.points, ((0, 0), (0, 1))), faces.ravel())
        numbers = np.arange(len(triangles), dtype="<u4").view(np.uint8).reshape(-1, 4)
        surface.cell_data["number"] = numbers[:, :3]
        return surface

    @cached_property
    def _window(self) -> vtkRenderWindow:
        """Twice as many pixels, each of one triangle: a mean of two numbers is the number of a third one.

        PyVista's plotter would draw every picture twice, and take a second to import.
        """
        extent, (height, width) = self.extent, self._size
        mapper, actor, renderer = vtkPolyDataMapper(), vtkActor(), vtkRenderer()
        mapper.SetInputData(self._surface)
        actor.SetMapper(mapper)
        actor.GetProperty().LightingOff()
        renderer.AddActor(actor)
        renderer.SetBackgroundAlpha(0.0)
        camera = renderer.GetActiveCamera()
        middle = ((extent.left + extent.right) / 2, (extent.bottom + extent.top) / 2)
        camera.ParallelProjectionOn()
        camera.SetFocalPoint(*middle, 0.0)
        camera.SetPosition(*middle, 100.0)
        camera.SetParallelScale(extent.height / 2)
        camera.SetClippingRange(50.0, 150.0)
        with _without_warnings():
            window = vtkRenderWindow()
        window.OffScreenRenderingOn()
        window.SetMultiSamples(0)
        window.SetAlphaBitPlanes(1)
        window.SetSize(2 * width, 2 * height)
        window.AddRenderer(renderer)
        return window

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
        self._surface.points = np.pad(points, ((0, 0), (0, 1)))
        count, (height, width), image = self._surface.n_cells, self._size, vtkUnsignedCharArray()
        with _without_warnings():
            self._window.Render()
            self._window.GetRGBACharPixelData(0, 0, 2 * width - 1, 2 * height - 1, 0, image, 0)
        words = np.asarray(pyvista.convert_array(image)).view("<u4").reshape(2 * height, -1)[::-1]
        number = np.where(words >> 24, words & 0xFFFFFF, count)
        quarters = number.reshape(height, 2, width, 2).transpose(1, 3, 0, 2).reshape(4, -1)
        pixels = np.flatnonzero((quarters < count).any(axis=0))
        return pixels, quarters[:, pixels].astype(np.int64)


@contextmanager
def _without_warnings() -> Iterator[None]:
    """VTK tries X, then EGL, then OSMesa, and warns at each that is missing; one that works is enough."""
    before = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    try:
        yield
    finally:
        vtkLogger.SetStderrVerbosity(before)

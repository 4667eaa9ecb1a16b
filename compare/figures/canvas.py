"""Triangles to pixels: PyVista off the screen, colours and camera given exactly, no text.

Type, axes and legends are matplotlib's; both use the same extent in mm, so that they fit to the pixel.
"""

import os
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

# Draw without a display: VTK otherwise complains of a missing X server before it does so anyway.
os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
import pyvista
from vtkmodules.vtkCommonCore import vtkLogger

from geometry.arrays import FloatArray
from geometry.mesh.triangle_mesh import TriangleMesh

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
        """Width, mm."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Height, mm."""
        return self.top - self.bottom


class Canvas(AbstractContextManager["Canvas"]):
    """A picture of a mesh that is coloured triangle by triangle, again and again; to be closed after use."""

    def __init__(self, mesh: TriangleMesh, extent: Extent, *, width: int) -> None:
        """Set the camera: `extent` fills a picture of `width` pixels, seen from the front."""
        pyvista.OFF_SCREEN = True
        self.extent = extent
        faces = np.insert(mesh.triangles, 0, 3, axis=1)
        self._surface = pyvista.PolyData(np.pad(mesh.points, ((0, 0), (0, 1))), faces.ravel())
        self._surface.cell_data["colour"] = np.zeros((len(faces), 3), dtype=np.uint8)
        size = (width, round(width * extent.height / extent.width))
        with _without_warnings():
            self._plotter = pyvista.Plotter(off_screen=True, window_size=list(size))
            self._plotter.add_mesh(self._surface, scalars="colour", rgb=True, lighting=False)
        camera = self._plotter.camera
        middle = ((extent.left + extent.right) / 2, (extent.bottom + extent.top) / 2)
        camera.parallel_projection = True
        camera.focal_point = (*middle, 0.0)
        camera.position = (*middle, 100.0)
        camera.up = (0.0, 1.0, 0.0)
        camera.parallel_scale = extent.height / 2
        camera.clipping_range = (50.0, 150.0)

    def __exit__(self, *_: object) -> None:
        """Free the graphics memory."""
        self._plotter.close()

    def picture(self, colours: Pixels, points: FloatArray | None = None) -> Pixels:
        """The mesh in those colours, transparent where it is not.

        Args:
            colours: Red, green and blue of every triangle, shape (t, 3).
            points: Where the nodes are, shape (n, 2), mm, if not where the mesh has them.

        Returns:
            Red, green, blue and opacity, shape (height, width, 4).
        """
        if points is not None:
            self._surface.points = np.pad(points, ((0, 0), (0, 1)))
        self._surface.cell_data["colour"] = colours
        self._surface.Modified()  # VTK would show the picture before
        self._plotter.render()
        with _without_warnings():
            image = self._plotter.screenshot(None, transparent_background=True, return_img=True)
        return np.array(image, dtype=np.uint8)


@contextmanager
def _without_warnings() -> Iterator[None]:
    """VTK tries X, then EGL, then OSMesa, and warns at each that is missing; one that works is enough."""
    before = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    try:
        yield
    finally:
        vtkLogger.SetStderrVerbosity(before)

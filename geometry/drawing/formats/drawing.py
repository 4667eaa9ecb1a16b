"""A drawing as read: closed curves with labels, marker circles and the file that they come from."""

import re
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from pinnray.geometry.section.loop import Loop
from pinnray.runtime.arrays import FloatArray, IntArray

LABELS = {"clamp": "base", "base": "base", "front": "front", "contact": "contact", "markers": "markers"}
"""Labels that mean something to the finger, by their names in files."""

UNITS = {
    **{"um": 1e-3, "mm": 1.0, "cm": 10.0, "dm": 100.0, "m": 1000.0},
    **{"mil": 0.0254, "in": 25.4, "ft": 304.8, "yd": 914.4, "pt": 25.4 / 72, "px": 25.4 / 96},
}
"""Units of length, mm."""


class Scale(NamedTuple):
    """Length of one unit of a file's coordinates, mm, with its name and where it comes from."""

    length: float = 1.0
    name: str = "mm"
    origin: str = "assumed"  # or `given`, `of the header`, `of the file`

    def __str__(self) -> str:
        """In words, such as `mm (assumed)`."""
        return f"{self.name} ({self.origin})"


@dataclass(frozen=True, eq=False)
class MeshInFile:
    """A plane triangle mesh of a file: nodes (n, 2), mm, and triangles (t, 3)."""

    points: FloatArray
    triangles: IntArray


@dataclass(frozen=True, eq=False)
class Drawing:
    """Closed curves of a file, mm, in the file's own frame; None stands for what it does not hold."""

    loops: tuple[Loop, ...]  # the name of a piece is its label in lower case
    unit: float = 1.0  # length of one unit of the file's coordinates, mm
    note: str = ""  # how the file was read, in words
    markers: FloatArray = field(default_factory=lambda: np.empty((0, 2)))  # their centres, (m, 2), mm
    marker_diameter: float | None = None  # mm
    marker_height: float | None = None  # depth to which they are inlaid, mm
    contact: FloatArray | None = None  # point of that label, (2,), mm
    depth: float | None = None  # of the extrusion, mm
    mesh: MeshInFile | None = None  # with its boundaries named
    file: str = ""
    sha256: str = ""  # of the content, in hexadecimal


class MarkerSize(NamedTuple):
    """Diameter of all markers, mm, and what a note says of those that are larger."""

    diameter: float | None
    note: str = ""

    @classmethod
    def of(cls, diameters: FloatArray) -> "MarkerSize":
        """The mean of equal diameters (m,), mm, or the least of others: means over discs hardly differ."""
        if not len(diameters):
            return cls(None)
        low, high = float(diameters.min()), float(diameters.max())
        if high - low <= 0.01 * high:
            return cls(float(diameters.mean()))
        return cls(low, f", markers of {low:.4g} to {high:.4g} mm taken as of {low:.4g} mm")


def label_of(text: str) -> str:
    """A label in lower case, without the number that Fusion adds to names, as in `clamp:2`."""
    return re.sub(r":\d+$", "", text.strip().lower())


def place(point: FloatArray) -> str:
    """A point of the drawing in words, such as `(3.25, -1)`."""
    x, y = (f"{round(float(value), 4) + 0.0:.6g}" for value in point)
    return f"({x}, {y})"

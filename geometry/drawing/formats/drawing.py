"""A drawing as read: closed curves with labels, marker circles and the file that they come from."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from geometry.arrays import FloatArray, IntArray
from geometry.section.loop import Loop

LABELS = {"clamp": "base", "base": "base", "front": "front", "contact": "contact", "markers": "markers"}
"""Labels that mean something to the finger, by their names in files."""

UNITS = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
"""Units of length, mm."""


@dataclass(frozen=True, eq=False)
class MeshInFile:
    """A plane triangle mesh of a file: nodes (n, 2), mm, triangles (t, 3), and edges (k, 2) of each group."""

    points: FloatArray
    triangles: IntArray
    edges: Mapping[str, IntArray]


@dataclass(frozen=True, eq=False)
class Drawing:
    """Closed curves of a file, mm, in the file's own frame.

    Attributes:
        loops: Closed curves; the name of a piece is its label in lower case.
        unit: Length of one unit of the file's coordinates, mm.
        note: How the file was read, in words.
        markers: Centres of the markers, shape (m, 2), mm; empty without any.
        marker_diameter: Their diameter, mm; None where the file has none.
        marker_height: How deep they are inlaid, mm; None where the file does not say.
        contact: Point that the file calls contact, shape (2,), mm, or None.
        depth: Depth of the extrusion, mm, or None.
        mesh: The triangle mesh, where the file holds a ready one with its boundaries named.
        file: Name of the file.
        sha256: Hash of its content, in hexadecimal.
    """

    loops: tuple[Loop, ...]
    unit: float = 1.0
    note: str = ""
    markers: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    marker_diameter: float | None = None
    marker_height: float | None = None
    contact: FloatArray | None = None
    depth: float | None = None
    mesh: MeshInFile | None = None
    file: str = ""
    sha256: str = ""


def label_of(text: str) -> str:
    """A label in lower case."""
    return text.strip().lower()


def place(point: FloatArray) -> str:
    """A point of the drawing in words, such as `(3.25, -1)`."""
    x, y = (f"{round(float(value), 4) + 0.0:.6g}" for value in point)
    return f"({x}, {y})"

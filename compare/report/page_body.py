"""The body of an interactive page, drawn by `templates/body.js` of `runtime`: for report and explorer."""

from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import to_hex

from pinnray.comparison.figures.body import DIVERGING, SEQUENTIAL
from pinnray.geometry.mesh.boundary import edge_paths
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.html import Packed

COLOURS = 32
"""Colours of a scale: the triangles of each are one path."""


def packed_body(mesh: TriangleMesh, packed: Packed) -> dict[str, Any]:
    """Outlines, packed points and triangles of a body, and the colours of fields and of differences."""
    shares = np.linspace(0, 1, COLOURS)
    scales = {"colours": mpl.colormaps[SEQUENTIAL], "differences": mpl.colormaps[DIVERGING]}
    return {
        "outlines": [path.tolist() for path in edge_paths(mesh.boundary_edges)],
        "points": packed.add(mesh.points.astype("<f8")),
        "triangles": packed.add(mesh.triangles.astype("<u4")),
        **{name: [to_hex(colour) for colour in scale(shares)] for name, scale in scales.items()},
    }

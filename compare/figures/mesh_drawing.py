"""A picture of the mesh."""

import numpy as np
from matplotlib.collections import LineCollection

from pinnray.comparison.figures import body
from pinnray.comparison.figures.layout import LEGEND_LINE, axes_at, wrapped, write_heading
from pinnray.geometry.mesh.boundary import edge_paths
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.figure import CONTACT, MEASURED, WIDTH, Figure, figure

HEAD, MARGIN = 0.48, 0.1
"""Height of the heading, and the margin, inches."""


def mesh_numbers(mesh: TriangleMesh) -> dict[str, str]:
    """Size of a mesh, range of its edge lengths and quality of its triangles (`quality`), as text."""
    ends = mesh.points[mesh.edges]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    good = quality(mesh)
    return {
        "size": f"{len(mesh.points)} nodes, {len(mesh.triangles)} triangles",
        "edges": f"{length.min():.3g} to {length.max():.3g} mm",
        "quality": f"worst {good.min():.2f}, mean {good.mean():.2f}",
    }


def quality(mesh: TriangleMesh) -> FloatArray:
    """Twice the inscribed over the circumscribed radius of every triangle, shape (t,).

    One for an equilateral triangle, zero for a flat one.
    """
    corners = mesh.points[mesh.triangles]
    a, b, c = (np.linalg.norm(corners[:, i] - corners[:, (i + 1) % 3], axis=1) for i in range(3))
    return np.asarray((b + c - a) * (c + a - b) * (a + b - c) / (a * b * c))


def draw_mesh(mesh: TriangleMesh, page: float = WIDTH) -> Figure:
    """Draw the mesh with its contact, clamp and markers, on a page of a width in inches."""
    width = page - 2 * MARGIN
    size = float(np.ptp(mesh.points, axis=0).max())
    extent = body.panel_extent(mesh.points, width, margin=0.025 * size, tallest=4.2)
    height = width * extent.height / extent.width
    numbers = mesh_numbers(mesh)
    note = wrapped(f"{numbers['size']}; edges {numbers['edges']}; quality: {numbers['quality']}", width)
    head = HEAD + LEGEND_LINE * note.count("\n")
    with figure(head + height + MARGIN, page) as drawn:
        write_heading(drawn, "Mesh, shared by every solver", note)
        axes = axes_at(drawn, (MARGIN, head, width, height))
        body.prepare(axes, extent)
        edges = LineCollection(list(mesh.points[mesh.edges]), colors="#3d5a80", linewidths=0.12)
        axes.add_collection(edges, autolim=False)
        body.draw_outline(axes, edge_paths(mesh.boundary_edges), mesh.points)
        contact = edge_paths(mesh.boundary("contact"))
        body.draw_outline(axes, contact, mesh.points, colour=CONTACT, width=2.2, zorder=4)
        axes.plot(*mesh.markers.T, "o", ms=2.5, mfc=MEASURED, mec="white", mew=0.5, zorder=4)
        body.clamp(axes, body.base_lines(mesh), size=body.hatch_size(mesh.points))
        body.scale_bar(axes, extent)
    return drawn
